#include "random/special.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/epsilon.hpp"

namespace pendula::random {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A rational function with numerator n₀ + n₁ r + … and denominator 1 + d₁ r + …
double ratio(double r, const double (&n)[8], const double (&d)[7]) {
  double top = n[7], bottom = d[6];
  for (int k = 6; k >= 0; --k) top = top * r + n[k];
  for (int k = 5; k >= 0; --k) bottom = bottom * r + d[k];
  return top / (bottom * r + 1);
}

/// log(Γ(a) Γ(b)/Γ(a + b)). For large arguments the terms cancel, therefore the difference is computed with
/// Stirling's series (A = lnΓ(z) - (z - ½) ln z + z - ½ ln 2π, Abramowitz & Stegun 6.1.41).
double log_beta(double a, double b) {
  // Stirling's series leaves out 0.0019/z¹¹, 2e-16 at 15, and terms up to lgamma(1000) = 5905 cost four of
  // sixteen digits.
  constexpr double large = 15, cancels = 1e3;
  if (std::min(a, b) < large && std::max(a, b) < cancels)
    return std::lgamma(a) + std::lgamma(b) - std::lgamma(a + b);
  const auto rest = [](double z) {
    const double w = 1 / (z * z);
    return (1.0 / 12 - w * (1.0 / 360 - w * (1.0 / 1260 - w * (1.0 / 1680 - w / 1188)))) / z;
  };
  const double s = a + b;
  if (std::min(a, b) >= large)
    return 0.5 * std::log(2 * M_PI) - 0.5 * std::log(b) + (a - 0.5) * std::log(a / s) -
           b * std::log1p(a / b) + rest(a) + rest(b) - rest(s);
  const double p = std::min(a, b), q = std::max(a, b);  // one large, one small
  return std::lgamma(p) + p - p * std::log(s) - (q - 0.5) * std::log1p(p / q) + rest(q) - rest(s);
}

/// The continued fraction for x < (a + 1)/(a + b + 2), where it converges fast.
double fraction(double a, double b, double x) {
  const auto nonzero = [](double v) { return std::fabs(v) < least_size ? least_size : v; };
  double c = 1, d = 1 / nonzero(1 - (a + b) * x / (a + 1)), h = d;
  constexpr int most = 100'000;  // a cap: it takes some √max(a, b) steps
  for (int m = 1; m < most; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / nonzero(1 + even * d);
    c = nonzero(1 + even / c);
    h *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / nonzero(1 + odd * d);
    c = nonzero(1 + odd / c);
    const double change = d * c;
    h *= change;
    if (std::fabs(change - 1) <= 2 * eps) break;
  }
  return h;
}

double log_density(double a, double b, double x) {
  return (a - 1) * std::log(x) + (b - 1) * std::log1p(-x) - log_beta(a, b);
}

}  // namespace

double normal_cdf(double x) { return 0.5 * std::erfc(-x * M_SQRT1_2); }

double normal_quantile(double p) {
  if (!(p >= 0 && p <= 1)) return std::numeric_limits<double>::quiet_NaN();
  if (p == 0 || p == 1) return p == 0 ? -infinity : infinity;
  static const double a[8] = {3.3871328727963666080e0,  1.3314166789178437745e+2, 1.9715909503065514427e+3,
                              1.3731693765509461125e+4, 4.5921953931549871457e+4, 6.7265770927008700853e+4,
                              3.3430575583588128105e+4, 2.5090809287301226727e+3};
  static const double b[7] = {4.2313330701600911252e+1, 6.8718700749205790830e+2, 5.3941960214247511077e+3,
                              2.1213794301586595867e+4, 3.9307895800092710610e+4, 2.8729085735721942674e+4,
                              5.2264952788528545610e+3};
  static const double c[8] = {1.42343711074968357734e0,  4.63033784615654529590e0, 5.76949722146069140550e0,
                              3.64784832476320460504e0,  1.27045825245236838258e0, 2.41780725177450611770e-1,
                              2.27238449892691845833e-2, 7.74545014278341407640e-4};
  static const double d[7] = {2.05319162663775882187e0,  1.67638483018380384940e0,  6.89767334985100004550e-1,
                              1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4,
                              1.05075007164441684324e-9};
  static const double e[8] = {6.65790464350110377720e0,  5.46378491116411436990e0,  1.78482653991729133580e0,
                              2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
                              2.71155556874348757815e-5, 2.01033439929228813265e-7};
  static const double f[7] = {5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
                              7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7,
                              2.04426310338993978564e-15};
  const double q = p - 0.5;
  if (std::fabs(q) <= 0.425) return q * ratio(0.180625 - q * q, a, b);
  const double r = std::sqrt(-std::log(q < 0 ? p : 1 - p));
  const double x = r <= 5 ? ratio(r - 1.6, c, d) : ratio(r - 5, e, f);
  return q < 0 ? -x : x;
}

double beta_cdf(double a, double b, double x) {
  if (!(x > 0)) return 0;
  if (x >= 1) return 1;
  const double front = std::exp(a * std::log(x) + b * std::log1p(-x) - log_beta(a, b));
  if (x < (a + 1) / (a + b + 2)) return front * fraction(a, b, x) / a;
  return 1 - front * fraction(b, a, 1 - x) / b;
}

double beta_quantile(double a, double b, double p) {
  if (!(p >= 0 && p <= 1)) return std::numeric_limits<double>::quiet_NaN();
  if (p == 0 || p == 1) return p;
  double low = 0, high = 1, x = a / (a + b);
  // Near 0 the function is x^a/(a B(a, b)); if its solution is far below the mean, it is the
  // better starting point.
  const double left = std::exp((std::log(p * a) + log_beta(a, b)) / a);
  if (left < x / 4) x = left;
  constexpr int most = 200;  // a cap: where Newton's method leaves the interval, that is halved
  for (int k = 0; k < most; ++k) {
    const double error = beta_cdf(a, b, x) - p;
    (error < 0 ? low : high) = x;
    double next = x - error * std::exp(-log_density(a, b, x));
    if (!(next > low && next < high))
      next = low > 0 && high / low > 16 ? std::sqrt(low * high) : (low + high) / 2;
    if (std::fabs(next - x) <= 2 * eps * next || high - low <= 2 * eps * high) return next;
    x = next;
  }
  return x;
}

}  // namespace pendula::random
