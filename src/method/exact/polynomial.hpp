// Polynomials over ℚ(√d), decided exactly: Euclid, Yun's square-free factors, Sturm's count of real zeros,
// Routh-Hurwitz. Coefficients by increasing power, without zeros at the top; the zero polynomial is empty.
#pragma once

#include "method/exact/surd.hpp"

namespace pendula::integrate {

using Polynomial = std::vector<Surd>;

void trim(Polynomial& p);
inline int degree(const Polynomial& p) { return static_cast<int>(p.size()) - 1; }
Polynomial plus(const Polynomial& a, const Polynomial& b);
Polynomial minus(const Polynomial& a, const Polynomial& b);
Polynomial times(const Polynomial& a, const Polynomial& b);
Polynomial derivative(const Polynomial& p);
/// a = q b + r. Requires b ≠ 0.
struct Division {
  Polynomial quotient, remainder;
};
Division divide(Polynomial a, const Polynomial& b);
Polynomial greatest_common_divisor(Polynomial a, Polynomial b);  ///< leading coefficient 1
Real evaluate(const Polynomial& p, const Real& x);
int sign_at(const Polynomial& p, const mpq_class& x);

/// The product of the square-free factors of odd multiplicity: its real zeros are where p changes sign.
Polynomial sign_changing_part(const Polynomial& p);

/// The smallest x > 0 where p changes sign, to `digits` decimal digits; nothing if
/// there is none. p(0) may be 0.
std::optional<double> first_sign_change(const Polynomial& p);

/// p(x) ≥ 0 for all x ≥ 0.
bool nonnegative(const Polynomial& p);

/// All zeros in the open left half-plane (Routh's array).
bool is_hurwitz(const Polynomial& p);

}  // namespace pendula::integrate
