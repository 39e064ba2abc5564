// Decompositions of matrices of numbers, in doubles, and what follows from them.
//
// Signs are fixed, so that a matrix has one answer: the largest entry of every right singular
// vector, and the diagonal of R, are not negative. Large ones can be interrupted
// (base/stoppable.hpp). Requires entries, all finite.
#pragma once

#include "base/math.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::linalg {

/// A = U diag(s) Vᵀ with as many columns as the smaller size of A.
struct SingularValues {
  explicit SingularValues(const Mat& A);
  /// Singular values above rounding: the largest size of A times ε times the largest of them (Golub & Van
  /// Loan, Matrix Computations, §5.4.1).
  Eigen::Index rank(const Mat& A) const;
  Mat U, V;
  Vec s;
};
/// A⁺ (Moore, Penrose).
Mat pseudoinverse(const Mat& A);
/// s₁/sₙ; infinite for singular A.
double condition_number(const Mat& A);
/// Orthonormal columns that span the solutions of A x = 0.
Mat orthonormal_null_space(const Mat& A);

/// A = Q R with orthonormal columns Q.
struct OrthogonalFactors {
  explicit OrthogonalFactors(const Mat& A);
  Mat Q, R;
};

/// P A = L U for square A.
struct TriangularFactors {
  explicit TriangularFactors(const Mat& A);
  Mat L, U, P;
};

/// L with A = L Lᵀ for square A. Throws Error that names a pair of entries where A is not symmetric to 12
/// digits, and the first leading minor that is not positive.
Mat cholesky_factor(const Mat& A);

/// A ⊗ B. Throws Error beyond a million entries.
MatX kronecker_product(const MatX& A, const MatX& B);

}  // namespace pendula::linalg
