// Sparse linear systems of a start. Eigen's sparse factorisations are compiled here and nowhere else: they take
// longer than all that a start does with them.
#pragma once

#include <Eigen/SparseCore>
#include <optional>

#include "base/math.hpp"

namespace pendula::dae {

/// x with A x = b: LU with pivoting, refined once. Nothing where A is singular; x may not be finite where it nearly is.
/// requires  A compressed
std::optional<Vec> solve_by_lu(const Eigen::SparseMatrix<double>& A, const Vec& b);
/// The same for a symmetric A that need not be definite: LDLᵀ without pivoting, refined twice. Nothing where a pivot
/// vanishes; inaccurate where one nearly does.
std::optional<Vec> solve_by_ldlt(const Eigen::SparseMatrix<double>& A, const Vec& b);

}  // namespace pendula::dae
