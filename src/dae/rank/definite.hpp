// Is a matrix of expressions symmetric and definite? Then it can be factored without pivoting.
#pragma once

#include <unordered_map>
#include <vector>

#include "expr/graph/derivative.hpp"

namespace pendula::dae {

/// Symmetry is an identity (checked exactly at a random point of a large field); definiteness is tried at
/// several real points, with the given values for parameters. That is enough: along a solution the
/// eigenvalues of a symmetric matrix move continuously, so a definite one stays definite until it becomes
/// singular, where nothing solves it. entries: of an n×n matrix, by rows. False where it cannot be decided.
/// Cost: a few evaluations and sparse Cholesky.
bool is_definite(int n, const std::vector<Entry>& entries,
                 const std::unordered_map<Expr, double>& parameters);
/// The same: 1 where it is positive definite, -1 negative, 0 neither.
int definite_sign(int n, const std::vector<Entry>& entries,
                  const std::unordered_map<Expr, double>& parameters);

}  // namespace pendula::dae
