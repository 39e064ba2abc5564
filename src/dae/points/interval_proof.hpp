// Proofs that equations have no common solution: interval arithmetic along the graph.
#pragma once

#include <span>
#include <unordered_map>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// Every node of 0 = rows gets an interval that contains its values at all common solutions: from the
/// operands to the operation, and back from the result to the operands, until nothing shrinks (hull
/// consistency; Benhamou, Goualard, Granvilliers & Puget, ICLP 1999). Rounding is outward.
///
/// known     values of leaves, right to 10⁻¹²; all others may be any number
/// returns   true: an interval is empty, so that no values of the other leaves
///           satisfy all rows; false: not decided
/// cost      at most 100 passes over the graph; 15 times that where intervals of unknowns are split at 0:
///           bounded ones, and all of up to 12 rows
bool has_no_solution(std::span<const Expr> rows, const std::unordered_map<Expr, double>& known);

}  // namespace pendula::dae
