// Equations that contain a factor more than once: where it vanishes so does the gradient.
#pragma once

#include <optional>
#include <unordered_set>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// z³ - 3 z + 2 = (z - 1)² (z + 2), with the same zeros as (z - 1)(z + 2).
struct RepeatedFactors {
  Expr square_free;  ///< every factor once
  bool all;          ///< all factors with unknowns are repeated, so that the gradient vanishes at every zero
};

/// The factors of e over ℚ; functions such as sin(x) count as symbols. Bases: the unknowns.
///
/// returns   nothing if no factor with unknowns is repeated, or e is no polynomial, inexact or long
/// cost      one factorisation of up to 100 operations if e contains a power at all
std::optional<RepeatedFactors> repeated_factors(Expr e, const std::unordered_set<Expr>& bases);
/// Is e a product of repeated factors such as C²? Its gradient vanishes where it does, and numbers near that
/// do not show it.
bool is_power(Expr e, const std::unordered_set<Expr>& bases);

}  // namespace pendula::dae
