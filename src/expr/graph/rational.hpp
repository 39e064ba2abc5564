// Matrices of rational numbers: fraction-free elimination (Bareiss, Math. Comp. 22(103), 1968).
#pragma once

#include <optional>
#include <vector>

#include <gmpxx.h>

#include "expr/graph/matrix.hpp"

namespace pendula::rational {

using Rows = std::vector<std::vector<mpz_class>>;

/// Gauss–Jordan form without fractions: every pivot equals `pivot`, above and below it are zeros.
struct Echelon {
  Rows rows;
  std::vector<int> pivot_column;  ///< of row i; its size is the rank
  mpz_class pivot = 1;
  int sign = 1;  ///< of the row permutation
};
/// Eliminates in the first `columns` columns; those to the right come along. Cost: O(n³) multiplications of
/// integers that are minors of the matrix.
Echelon eliminate(Rows rows, int columns);

/// The rows scaled to integers without common factor; scale[i] is what row i was multiplied with. Requires
/// constants that are exact.
Rows integer_rows(const MatX& a, std::vector<mpq_class>& scale);

/// x with a x = b, nothing where a is singular. Requires constants that are exact, a square.
std::optional<MatX> solve(const MatX& a, const MatX& b);

/// The kernel vector that belongs to the first column without a pivot, as coprime integers.
std::optional<VecX> null_vector(const Echelon& e, int columns);

/// Coefficients 1, c₁, …, cₙ of det(sI - a).
std::vector<mpq_class> characteristic(const MatX& a);

/// The rational roots of a polynomial (highest coefficient first) near the approximations, with multiplicity;
/// the polynomial is divided by their factors.
std::vector<mpq_class> divide_rational_roots(std::vector<mpq_class>& polynomial,
                                             const std::vector<double>& near);

}  // namespace pendula::rational
