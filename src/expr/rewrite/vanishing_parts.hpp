// Numbers that are zero but for rounding: cos(a) for a = π/2 read as a double.
#pragma once

#include <span>
#include <unordered_map>

#include "expr/graph/derivative.hpp"

namespace pendula {

/// Parts of the expressions that consist of symbols with values, and are zero there up to the rounding of
/// these values, as the substitution part -> 0. Values that are exact rationals are not rounded.
Substitution vanishing_parts(std::span<const Expr> expressions, const std::unordered_map<Expr, Expr>& values);

}  // namespace pendula
