// Exact linear algebra on matrices of expressions, and its numerical counterpart on doubles.
//
// Rational matrices are treated exactly by elimination over the integers. Symbolic matrices: determinants of
// small matrices are sums of products (minors, no division), larger systems a straight line of eliminations
// on the graph; a pivot is accepted only if it does not vanish identically, which is decided at a random
// point (generic.hpp).
#pragma once

#include <optional>
#include <vector>

#include "base/math.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::linalg {

/// All entries are rational numbers.
bool is_rational(const MatX& a);

/// Rank of a rational matrix; of a symbolic one the rank at almost all values of its symbols.
int rank(const MatX& a);
/// Number of singular values above max(m, n)·ε·σ₁.
int rank(const Mat& a);

/// requires  a square
Expr determinant(const MatX& a);
double determinant(const Mat& a);

/// x with a x = b for a ∈ ℝⁿˣⁿ, b ∈ ℝⁿˣᵐ. Throws Error with a null vector of a where a is singular
MatX solve(const MatX& a, const MatX& b);
Mat solve(const Mat& a, const Mat& b);
MatX inverse(const MatX& a);
Mat inverse(const Mat& a);

/// A v ≠ 0 with a v = 0, free of common factors where a is rational, if there is one.
std::optional<VecX> null_vector(const MatX& a);

/// 1, c₁, …, cₙ with det(sI - a) = sⁿ + c₁sⁿ⁻¹ + … + cₙ (Faddeev–LeVerrier: divides by integers only).
VecX characteristic(const MatX& a);
/// The same of doubles, the digits that a has: exact on its entries up to 40 rows, then
/// rounded; beyond from the eigenvalues.
Vec characteristic(const Mat& a);

struct Eigenvalue {
  Expr re, im;
};
/// All eigenvalues with multiplicity where they are rational, or all but two are; nothing otherwise. Sorted
/// by real part, then imaginary part. Requires a rational matrix.
std::optional<std::vector<Eigenvalue>> exact_eigenvalues(const MatX& a);

struct Eigensystem {
  Vec re, im;                  ///< sorted as above
  Mat vectors_re, vectors_im;  ///< columns of norm 1
};
Eigensystem eigensystem(const Mat& a);

/// eᵃ where it is exact: a is nilpotent, or a = R s with a scalar s and a rational R whose eigenvalues are
/// rational (Putzer, Amer. Math. Monthly 73(1), 1966). Nothing otherwise.
std::optional<MatX> exact_exponential(const MatX& a);
/// eᵃ of doubles with bounds of the errors of its entries (matrix_exponential.cpp): 12 digits relative to the
/// largest entry of the row or of the column, for up to 24 rows whatever the decades of a.
/// throws  Error where a is not square or not finite, Failure where the result overflows
struct BoundedExponential {
  Mat value, error;
};
BoundedExponential bounded_exponential(const Mat& a);
Mat exponential(const Mat& a);
/// The principal logarithm, eigenvalues with imaginary parts in (-π, π), and square root,
/// eigenvalues in the right half-plane (matrix_roots.cpp). Throws Error with the eigenvalue on the
/// negative real axis, or 0 (logarithm)
Mat logarithm(const Mat& a);
Mat square_root(const Mat& a);
/// Powers of two d with similar rows and columns of diag(d)⁻¹ A diag(d). A column without a row (an input
/// that is constant) is scaled to the size of the others, as is a row without a column.
Vec balancing(const Mat& a);
/// diag(d)⁻¹ A diag(d)
Mat similar(const Mat& a, const Vec& d);

/// -(∂r/∂z)⁻¹ ∂r/∂y: the derivative of z(y) where r(y, z) = 0, near a point at which ∂r/∂z is regular
/// (implicit function theorem).
/// requires  |r| = |z|
/// throws    Error with a null vector if ∂r/∂z is singular for all values of the symbols
MatX implicit_jacobian(std::span<const Expr> r, std::span<const Expr> z, std::span<const Expr> y);

}  // namespace pendula::linalg
