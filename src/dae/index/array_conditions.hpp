// Conditions on x that a derivative array contains as combinations of its rows with rational multipliers.
#pragma once

#include <functional>

#include "dae/index/array_index.hpp"
#include "dae/points/derivative_array.hpp"
#include "dae/rank/tracked_elimination.hpp"

namespace pendula::dae {

/// The sign that makes the coefficient of the first unknown positive, where it is a number.
Expr with_leading_sign(Expr residual, const std::vector<Expr>& states);

/// All independent ones among the first `orders` derivatives, in the order in which they appear. Rows whose
/// derivatives with respect to y are not all rational constants are left out. `independent` decides whether
/// a condition adds to those found.
std::vector<ArrayCondition> explicit_conditions(
    const Model& model, const DerivativeArray& array, int orders,
    const std::function<bool(const std::vector<Expr>& found)>& independent);

}  // namespace pendula::dae
