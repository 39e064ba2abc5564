// Polynomials in s (or z) whose coefficients are expressions, and fractions of them.
#pragma once

#include <string>
#include <vector>

#include "base/arithmetic.hpp"
#include "dae/pencil/pencil_modes.hpp"
#include "lti/matrices.hpp"

namespace pendula::lti {

/// Coefficients, lowest power first, the last one not zero; empty is 0.
using Polynomial = std::vector<Expr>;

inline int degree(const Polynomial& p) { return static_cast<int>(p.size()) - 1; }
/// Simplifies coefficients and drops leading ones that vanish identically.
Polynomial tidy(Polynomial p);
using arithmetic::operator+;  // of numbers, beside those below
using arithmetic::operator-;
using arithmetic::operator*;
Polynomial operator+(const Polynomial& a, const Polynomial& b);
Polynomial operator-(const Polynomial& a, const Polynomial& b);
Polynomial operator*(const Polynomial& a, const Polynomial& b);
Polynomial scaled(Expr factor, Polynomial p);
Polynomial power(const Polynomial& p, int n);
/// p(s) as a sum of powers.
Expr expression(const Polynomial& p, Expr s);
/// p(s) by Horner's rule. Requires constants.
Complex value(const std::vector<double>& p, Complex s);
std::vector<double> numbers(const Polynomial& p);

dae::Polynomial rational(const Polynomial& p);  ///< requires constants
Polynomial expressions(const dae::Polynomial& p);

/// Division with remainder over the field of the coefficients; requires b ≠ 0.
struct Quotient {
  Polynomial quotient, remainder;
};
Quotient divide(const Polynomial& a, const Polynomial& b);
/// Monic. Exact and symbolic coefficients; of numeric ones 1 (common zeros are then a matter of tolerance).
/// Symbolic: the degree is found at a random point modulo a prime first.
Polynomial gcd(const Polynomial& a, const Polynomial& b);

/// Zeros with multiplicity, by real part, then imaginary part: exact where rational or quadratic, else in
/// doubles (companion matrix, Newton steps in extended precision). Requires constants and p ≠ 0.
std::vector<dae::Mode> zeros(const Polynomial& p);

/// Π (s - rᵢ)
Polynomial from_zeros(const std::vector<std::pair<Expr, Expr>>& zeros);

/// num / den in lowest powers first; den is not zero.
struct Fraction {
  Polynomial num, den = {1};
};
/// Without common factor (gcd), the denominator monic.
Fraction cancelled(const Fraction& f);
Fraction sum(const Fraction& a, const Fraction& b);  ///< over the least common denominator
Fraction product(const Fraction& a, const Fraction& b);

/// "s² + 3 s + 1"; LaTeX with `latex`.
std::string to_text(const Polynomial& p, const std::string& variable, bool latex = false);
/// One line where the denominator is 1, else three: numerator, rule, denominator.
std::vector<std::string> lines(const std::string& above, const std::string& below);

}  // namespace pendula::lti
