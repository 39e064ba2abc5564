// Polynomials over the rationals and the zeros of those that matter: characteristic
// polynomials; exact exponentials.
#pragma once

#include <complex>
#include <optional>
#include <vector>

#include "dae/rank/rational_matrix.hpp"

namespace pendula::dae {

/// Coefficients, lowest power first, the last one nonzero; empty is 0.
using Polynomial = std::vector<mpq_class>;

Polynomial product(const Polynomial& a, const Polynomial& b);
struct Division {
  Polynomial quotient, remainder;
};
Division divide(Polynomial a, const Polynomial& b);
Polynomial derivative(const Polynomial& a);
Polynomial gcd(Polynomial a, Polynomial b);  ///< monic
mpq_class value(const Polynomial& a, const mpq_class& s);
RationalMatrix value(const Polynomial& a, const RationalMatrix& m);
Expr expression(const Polynomial& a, Expr s);
/// det(sI - m)
Polynomial characteristic(const RationalMatrix& m);

/// A monic factor without multiple zeros. Degrees 1 and 2 are irreducible or, with exact = false, what could
/// not be split into such.
struct Factor {
  Polynomial p;
  int multiplicity;
  std::vector<std::complex<double>> zeros;
  int degree() const { return static_cast<int>(p.size()) - 1; }
};
/// All linear and quadratic factors over ℚ, and the rest by multiplicity. Candidates come from numerical
/// zeros, every factor is confirmed by exact division.
std::vector<Factor> factors(const Polynomial& p);

/// A zero of the determinant; exact where it is rational or quadratic.
struct Mode {
  std::complex<double> value;
  int multiplicity;
  std::optional<std::pair<Expr, Expr>> exact;  ///< real and imaginary part
};
std::vector<Mode> modes(const std::vector<Factor>& factors);  ///< by real part, then imaginary part

/// Chains for a nilpotent matrix: P with P⁻¹ m P = Jordan form (ones above the diagonal), long blocks first.
RationalMatrix nilpotent_chains(const RationalMatrix& m);
/// P with P⁻¹ m P = diag(Jordan blocks of the rational eigenvalues, rest); the factors of
/// the characteristic polynomial.
RationalMatrix jordan_basis(const RationalMatrix& m, const std::vector<Factor>& factors);

/// e^{m t} v. Exact where the factors of the characteristic polynomial have degree 1 or 2; decimals in the
/// rest. Splits m = D + N by Newton's iteration for the squarefree factor (Chevalley), which is exact over ℚ.
VecX exponential(const RationalMatrix& m, Expr t, const VecX& v);

}  // namespace pendula::dae
