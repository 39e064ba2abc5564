// Sparse linear systems of a start. Eigen's sparse factorisations are compiled here and nowhere else: they
// take longer than all that a start does with them.
#pragma once

#include <Eigen/SparseCore>
#include <optional>

#include "base/math.hpp"

namespace pendula::dae {

/// x with A x = b: LU with pivoting, refined once. Nothing where A is singular; x may
/// not be finite where it nearly is.
/// requires  A compressed
std::optional<Vec> solve_by_lu(const Eigen::SparseMatrix<double>& A, const Vec& b);
/// The same for a symmetric A that need not be definite: LDLᵀ without pivoting, refined twice. Nothing where
/// a pivot vanishes; inaccurate where one nearly does.
std::optional<Vec> solve_by_ldlt(const Eigen::SparseMatrix<double>& A, const Vec& b);

/// The rank by QR with column ordering; columns whose rest is below 20 (m + n) ε times the longest column do
/// not count (Eigen's SparseQR, after Davis, ACM TOMS 38(1), 2011).
Eigen::Index sparse_rank(const Eigen::SparseMatrix<double>& A);

/// d with J d = -r where the rows and columns that are not zero make a square, regular system (what is left
/// once the states are held); 0 elsewhere.
std::optional<Vec> square_step(const Eigen::SparseMatrix<double>& J, const Vec& r);

/// [I J; Jᵀ -μ² I] [y; d] = [-r; 0]: d minimises ‖J d + r‖² + μ² ‖d‖². Without pivoting where that is
/// accurate, else with it.
Vec sparse_least_step(const Eigen::SparseMatrix<double>& J, const Vec& r);

}  // namespace pendula::dae
