// The linear systems that an explicit form solves at every evaluation, as a reader sees them: equations that
// name the multipliers, and A z = b below them.
#pragma once

#include <string>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// The equations with an eliminated unknown under its own name where a linear system gives it: z₁ in place of
/// component 1 of A⁻¹ b.
std::vector<Block> blocks_with_names(const Model& m);

/// "where A z = b with", then A and b, in the marks of derivation_markup.hpp; nothing for a model without
/// such a system. Systems too large for a line are left out: their size is said.
std::vector<std::string> linear_system_lines(const Model& m);

}  // namespace pendula::dae
