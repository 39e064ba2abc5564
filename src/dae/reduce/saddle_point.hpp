// Accelerations and multipliers of a mechanism with closed loops, eliminated by the mass matrix.
//
//   ⎡M  Cᵀ⎤ ⎡v⎤   ⎡f⎤        S = C M⁻¹ Cᵀ - D,   S z = C M⁻¹ f - g,   v = M⁻¹ (f - Cᵀ z)
//   ⎣C  D ⎦ ⎣z⎦ = ⎣g⎦        (the range-space method; Benzi, Golub & Liesen, Acta Numerica 14, 2005, §5)
//
// D comes from bodies that were eliminated before, else it is 0. M has a block for the bodies that share
// coordinates, S for the loops that share bodies; LU with pivoting of the whole matrix uses neither. M may be
// singular at some positions, or for other parameters, where the whole is regular: this is checked at every
// evaluation (codegen/program/symmetric.hpp), and pivoting takes over there.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "expr/graph/derivative.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::dae {

/// (v, z) as components of saddle_solution().
///
/// shapes    A: the entries of the whole matrix, b ∈ ℝⁿ; the last `multipliers` rows
///           and columns are those of g and z
/// returns   nothing where A has not this form, up to signs of rows, or M is not definite at random points
/// see       docs/derivations.md#closed-loops
std::optional<VecX> saddle_point_solution(const std::vector<Entry>& A, const VecX& b, int multipliers,
                                          const std::unordered_map<Expr, double>& parameters);

}  // namespace pendula::dae
