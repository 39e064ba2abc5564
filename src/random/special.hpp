// Distribution functions that the standard library has not: normal, beta.
#pragma once

namespace pendula::random {

/// Φ(x), relative accuracy near rounding in both tails.
double normal_cdf(double x);
/// Φ⁻¹(p), relative error about 1e-16. ±∞ at p = 0, 1; NaN outside.
/// Source: Wichura, Algorithm AS 241, Appl. Statist. 37(3), 1988.
double normal_quantile(double p);

/// I_x(a, b), the regularised incomplete beta function; a, b > 0. Relative error below 1e-12 for a, b ≤ 1e5.
/// Source: continued fraction DLMF 8.17.22 by Lentz's method.
double beta_cdf(double a, double b, double x);
/// The x with I_x(a, b) = p: Newton's method inside a shrinking bracket.
double beta_quantile(double a, double b, double p);

}  // namespace pendula::random
