// What may be divided by.
#pragma once

#include <optional>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// Does a coefficient contain parameters and constants only?
bool is_constant_coefficient(Expr c);

/// 0: ±1, 1: another number, 2: a product of parameters that is not 0 at their values, 3: a sum of such; nothing
/// else divides.
std::optional<int> pivot_class(const Model& model, Expr c);

}  // namespace pendula::dae
