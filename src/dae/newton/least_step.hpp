// Steps of Newton's and of Gauss-Newton iterations: d with J d ≈ -r. `least_step` chooses between an
// orthogonal decomposition and the sparse systems of `sparse_solution`; `block_solution` takes blocks in
// their order where one pair of units does not suit all rows; `lifted_newton` iterates with the exponents of
// exp() as unknowns of their own.
#pragma once

#include <Eigen/SparseCore>

#include "base/math.hpp"

namespace pendula::dae {

constexpr Eigen::Index dense_up_to = 250;  ///< unknowns

/// The smallest d that minimises ‖J d + r‖. Cost: one orthogonal decomposition; above
/// `dense_up_to` unknowns a sparse LU where the system is square and regular, else a sparse LDLᵀ
/// of the regularised normal equations.
Vec least_step(const Eigen::SparseMatrix<double>& J, const Vec& r);

/// A step with J d = -r in which every row and column counts alike, however large its numbers are.
Vec balanced_step(const Eigen::SparseMatrix<double>& J, const Vec& r);

/// What rows are multiplied by to have 1 as their largest entries: an equation that is flat at this point
/// counts as much as the others. 1 for empty rows.
Vec row_weights(const Eigen::SparseMatrix<double>& J);

bool all_finite(const Eigen::SparseMatrix<double>& J);

}  // namespace pendula::dae
