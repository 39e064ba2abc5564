// Pivots of symbolic elimination: coefficients that are not zero anywhere.
#pragma once

#include <optional>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// 0: ±1, 1: another number, 2: a product of parameters that is not 0 at their values, 3: a sum
/// of such; nothing else divides.
std::optional<int> pivot_class(const Model& model, Expr c);

}  // namespace pendula::dae
