// Surplus equations and unknowns without an equation, in the user's words.
#pragma once

#include "dae/model/model.hpp"
#include "dae/structure/blocks.hpp"

namespace pendula::dae {

/// "(1), (3)" and "x, y": at most twelve, then how many there are.
std::string equation_list(const Model& model, const std::vector<int>& rows);
std::string unknown_list(const Model& model, const std::vector<int>& columns);

/// Two lines at most: "over-determined: 2 equations (1), (2) for 1 unknown x" and the same for the
/// under-determined part. Equations without unknown are listed apart.
std::vector<std::string> balance_lines(const Model& model, const Blocks& blocks);

/// Counts, the parts by equation numbers and names, and what can be done: the message for models that are not
/// square or structurally singular.
std::string imbalance(const Model& model);

}  // namespace pendula::dae
