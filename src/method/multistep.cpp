#include "method/multistep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/search/golden_section.hpp"
#include "base/text.hpp"

namespace pendula::integrate {
namespace {

using Complex = std::complex<double>;

mpq_class power(long base, int exponent) {  // 0⁰ = 1
  mpz_class result = 1;
  for (int i = 0; i < exponent; ++i) result *= base;
  return result;
}

/// Σᵢ aᵢ(-i)^q - q Σᵢ bᵢ(-i)^(q-1): the defect for t^q at the new point.
mpq_class moment(const Multistep::Fractions& a, const Multistep::Fractions& b, int q) {
  mpq_class sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += a[i] * power(-static_cast<long>(i), q);
    if (q > 0) sum -= q * b[i] * power(-static_cast<long>(i), q - 1);
  }
  return sum;
}

/// Zeros and their parts are the same up to this: computed multiple ones of modulus 1 differ by roots of ε.
constexpr double same_zero = 1e-9;

/// Zeros of Σ c[i] ζ^(n-i): eigenvalues of the companion matrix.
std::vector<Complex> zeros(std::vector<Complex> c) {
  while (!c.empty() && std::abs(c.front()) == 0) c.erase(c.begin());
  const auto n = static_cast<Eigen::Index>(c.size()) - 1;
  if (n < 1) return {};
  Eigen::MatrixXcd M = Eigen::MatrixXcd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) M(0, i) = -c[i + 1] / c[0];
  for (Eigen::Index i = 1; i < n; ++i) M(i, i - 1) = 1;
  const Eigen::VectorXcd values = Eigen::ComplexEigenSolver<Eigen::MatrixXcd>(M, false).eigenvalues();
  std::vector<Complex> result(values.data(), values.data() + values.size());
  std::sort(result.begin(), result.end(), [](Complex a, Complex b) {
    const double d = std::abs(a) - std::abs(b);
    return std::fabs(d) > same_zero ? d > 0 : a.imag() > b.imag();
  });
  return result;
}

/// ρ divided exactly by ζ - 1, which leaves the parasitic zeros.
Multistep::Fractions deflated(const Multistep::Fractions& alpha) {
  Multistep::Fractions quotient;
  mpq_class carry = 0;
  for (std::size_t i = 0; i + 1 < alpha.size(); ++i) quotient.push_back(carry += alpha[i]);
  return quotient;
}

std::vector<Complex> doubles(const Multistep::Fractions& list) {
  std::vector<Complex> result;
  for (const mpq_class& value : list) result.push_back(value.get_d());
  return result;
}

/// " - 18/11 x₋₁": a term of the formula with its sign.
std::string term(const mpq_class& value, const std::string& what, bool first) {
  const mpq_class size = abs(value);
  const std::string sign = sgn(value) < 0 ? (first ? "-" : " - ") : (first ? "" : " + ");
  return sign + (size == 1 ? "" : size.get_str() + "·") + what;
}

std::string point(const char* letter, std::size_t i) {
  const std::string k = text(letter, "ₖ");
  return i == 0 ? k + "₊₁" : i == 1 ? k : k + "₋" + subscript(static_cast<long>(i) - 1);
}

}  // namespace

Multistep::Multistep(std::string name, Fractions alpha, Fractions beta)
    : name_(std::move(name)), alpha_(std::move(alpha)), beta_(std::move(beta)) {
  const std::string subject = "multistep method '" + name_ + "'";
  if (alpha_.size() != beta_.size() || alpha_.size() < 2) {
    throw Error(text(subject, ": alpha has ", alpha_.size(), " entries and beta ", beta_.size(),
                     "; a k-step method has k + 1 of each, for the points x₊₁, x, x₋₁, …"));
  }
  if (alpha_[0] == 0) throw Error(subject + ": alpha[1], the coefficient of the new point, must not be 0");
  if (moment(alpha_, beta_, 0) != 0 || moment(alpha_, beta_, 1) != 0) {
    throw Error(text(subject, " is not consistent: ρ(1) = ", moment(alpha_, beta_, 0).get_str(),
                     " and ρ′(1) - σ(1) = ", moment(alpha_, beta_, 1).get_str(), "; both must be 0"));
  }
  for (order_ = 1; moment(alpha_, beta_, order_ + 1) == 0;) ++order_;
}

bool Multistep::is_bdf() const {
  return beta_[0] != 0 &&
         std::all_of(beta_.begin() + 1, beta_.end(), [](const mpq_class& b) { return b == 0; });
}

mpq_class Multistep::error_constant() const {
  mpq_class scale = 0;
  mpz_class factorial = 1;
  for (const mpq_class& b : beta_) scale += b;
  for (int i = 2; i <= order_ + 1; ++i) factorial *= i;
  return moment(alpha_, beta_, order_ + 1) / (scale * factorial);
}

std::vector<Complex> Multistep::parasitic_roots() const { return zeros(doubles(deflated(alpha_))); }

bool Multistep::is_zero_stable() const {
  constexpr double rounding = 1e-7;  // a double zero on the circle is accurate to √ε
  const std::vector<Complex> roots = parasitic_roots();
  for (std::size_t i = 0; i < roots.size(); ++i) {
    if (std::abs(roots[i]) > 1 + rounding) return false;
    if (std::abs(roots[i]) < 1 - rounding) continue;
    if (std::abs(roots[i] - 1.0) < rounding) return false;  // ζ = 1 twice
    for (std::size_t j = 0; j < i; ++j)
      // the two halves of a double zero lie on opposite sides of it, and a triple one errs by more
      if (std::abs(roots[i] - roots[j]) < 10 * rounding) return false;
  }
  return true;
}

Complex Multistep::locus(double angle) const {
  const Complex back = std::polar(1.0, -angle);
  Complex rho = 0, sigma = 0;
  for (std::size_t i = alpha_.size(); i-- > 0;) {
    rho = rho * back + alpha_[i].get_d();
    sigma = sigma * back + beta_[i].get_d();
  }
  return rho / sigma;
}

double Multistep::largest_root(Complex z) const {
  std::vector<Complex> c = doubles(alpha_);
  for (std::size_t i = 0; i < c.size(); ++i) c[i] -= z * beta_[i].get_d();
  const std::vector<Complex> roots = zeros(c);
  return roots.empty() ? 0 : std::abs(roots[0]);
}

bool Multistep::is_stable_at(Complex z) const {
  constexpr double rounding = 1e-12;  // of a simple zero of modulus 1: 4500 ε
  return largest_root(z) <= 1 + rounding;
}

bool Multistep::is_stable_at_infinity() const {
  const std::vector<Complex> roots = zeros(doubles(beta_));
  return beta_[0] != 0 && (roots.empty() || std::abs(roots[0]) < 1);
}

// The sector touches the boundary locus: finds the smallest angle to the negative axis of locus points with
// Re z < 0, on a grid refined by golden section.
double Multistep::alpha_degrees() const {
  constexpr int samples = 20000;       // 0.009° apart: narrower dips of the locus would be overlooked
  constexpr double near_zero = -1e-3;  // z of small steps: A(α)-stable methods are stable there
  constexpr double rounding = 1e-12;   // of points of the locus: 4500 ε
  constexpr double pi = std::numbers::pi;
  if (!is_zero_stable() || !is_stable_at_infinity() || !is_stable_at(near_zero)) return 0;
  const auto angle = [&](double phi) {
    const Complex z = locus(phi);
    // Near ζ = 1 the locus follows the imaginary axis to order p; deviations there are rounding errors.
    return z.real() < -rounding * (1 + std::abs(z)) ? std::atan2(std::fabs(z.imag()), -z.real()) : pi / 2;
  };
  double best = pi / 2, where = 0;
  for (int i = 1; i <= samples; ++i) {
    const double phi = pi * i / samples;
    if (angle(phi) < best) {
      best = angle(phi);
      where = phi;
    }
  }
  if (best < pi / 2) where = golden_section(angle, where - pi / samples, where + pi / samples, 100).middle();
  return std::min(best, angle(where)) * 180 / pi;
}

double Multistep::real_limit() const {
  // Choices: a method unstable at 10⁻⁶ is so at once, one that is stable beyond 10⁸ is so without end. Steps
  // of 10 % may pass over gaps that narrower ones would find.
  constexpr double least = 1e-6, most = 1e8, growth = 1.1;
  constexpr int halvings = 100;  // of an interval of 10 %, to the last bit
  if (!is_stable_at(-least)) return 0;
  double low = least, high = least;
  while (is_stable_at(-high)) {
    if (high > most) return std::numeric_limits<double>::infinity();
    low = high;
    high *= growth;
  }
  for (int i = 0; i < halvings; ++i) (is_stable_at(-(low + high) / 2) ? low : high) = (low + high) / 2;
  return low;
}

std::string Multistep::formula() const {
  std::string left, right;
  for (std::size_t i = 0; i < alpha_.size(); ++i) {
    if (alpha_[i] != 0) left += term(alpha_[i], point("x", i), left.empty());
    if (beta_[i] != 0) right += term(beta_[i], point("f", i), right.empty());
  }
  const bool single =
      std::count(beta_.begin(), beta_.end(), mpq_class(0)) + 1 == static_cast<long>(beta_.size());
  return left + " = Δt " + (single ? right : "(" + right + ")");
}

std::string Multistep::str() const {
  return text(name_, ": ", steps(), steps() == 1 ? " step" : " steps", ", order ", order_, ", ",
              is_explicit() ? "explicit" : "implicit", "\n\n", formula());
}

namespace {

/// "1, -1 and 0.2 ± 0.4 i", the zeros of ρ; if there are many, the largest modulus besides 1.
std::string zeros_text(const std::vector<Complex>& parasitic) {
  constexpr std::size_t most = 4;  // a line
  if (parasitic.empty()) return "the only zero of ρ is 1\n";
  if (parasitic.size() > most)
    return text("the zeros of ρ are 1 and ", parasitic.size(), " more, the largest of modulus ",
                rounded(std::abs(parasitic[0]), 6), "\n");
  std::vector<std::string> words{"1"};
  for (const Complex& z : parasitic) {
    const double size = std::max(1.0, std::abs(z));
    if (z.imag() < -same_zero * size) continue;  // its conjugate was listed
    const std::string re = rounded(std::fabs(z.real()) < same_zero ? 0 : z.real(), 6);
    words.push_back(std::fabs(z.imag()) <= same_zero * size ? re
                                                            : text(re, " ± ", rounded(z.imag(), 6), " i"));
  }
  const std::string last = words.back();
  words.pop_back();
  return text("the zeros of ρ are ", join(words, ", "), " and ", last, "\n");
}

}  // namespace

std::string Multistep::report() const {
  std::string result = str() + "\n\n";
  const std::vector<Complex> roots = parasitic_roots();
  const bool stable = is_zero_stable();
  result += text("consistency      ρ(1) = 0, ρ′(1) = σ(1); order ", order_, ", error constant ",
                 error_constant().get_str(), "\n");
  result += text("zero-stability   ", stable ? "yes" : "no", ": ");
  result += zeros_text(roots);
  if (!stable) return result + "                 errors grow without bound as Δt → 0: do not use it";
  const double alpha = alpha_degrees();
  result +=
      alpha >= 90 ? text("linear stability A-stable", is_stable_at_infinity() ? " and L-stable" : "", "\n")
      : alpha > 0 ? text("linear stability A(α)-stable with α = ", rounded(alpha, 4), "°\n")
      : real_limit() == 0
          ? text("linear stability no interval (-x, 0): on x′ = λx with λ < 0 errors grow for every step",
                 !roots.empty() && std::abs(roots[0]) > 1 - 1e-7 ? " (weak instability)\n" : "\n")
          : text("linear stability real interval (-", rounded(real_limit(), 6), ", 0)\n");
  if (is_stable_at_infinity()) {
    const bool bdf = is_bdf();
    result += text("at infinity      ", bdf ? "all zeros of σ are 0: stiff components die out at once\n"
                                            : "the zeros of σ lie inside the unit disc\n");
  }
  result +=
      "order barriers   A-stable multistep methods have order ≤ 2 (Dahlquist 1963); zero-stable ones with k "
      "steps\n                 order ≤ k + 2, k even, or k + 1 (Dahlquist 1956)\n";
  if (is_bdf()) {
    result += text("index 1, 2, 3    order ", order_,
                   " after the start for x and z (constant steps, exact starting ",
                   "values; Gear, Gupta & Leimkuhler 1985; Lötstedt & Petzold 1986)\n");
  }
  result.pop_back();
  return result;
}

namespace {

/// Σⱼ₌₁ᵏ ∇ʲ/j, the coefficients of xₖ₊₁, xₖ, …: the derivative of the polynomial through k + 1 points at
/// the newest one.
Multistep::Fractions backward_differences(int k) {
  Multistep::Fractions alpha(static_cast<std::size_t>(k) + 1, 0);
  for (int j = 1; j <= k; ++j) {
    mpz_class binomial = 1;
    for (int i = 0; i <= j; ++i) {
      mpq_class share(i % 2 ? mpz_class(-binomial) : binomial, j);
      share.canonicalize();
      alpha[i] += share;
      binomial = binomial * (j - i) / (i + 1);
    }
  }
  return alpha;
}

}  // namespace

Multistep bdf(long steps) {
  constexpr long most = 30;  // enough for the diagnosis of useless methods
  if (steps < 1 || steps > most) {
    throw Error(text(steps, " steps: the number must be between 1 and 6"));
  }
  const int k = static_cast<int>(steps);
  Multistep::Fractions beta(static_cast<std::size_t>(k) + 1, 0);
  beta[0] = 1;
  Multistep method(text("bdf(", k, ")"), backward_differences(k), beta);
  if (method.is_zero_stable()) return method;
  const Complex root = method.parasitic_roots()[0];
  throw Error(
      text("bdf(", k, ") is not zero-stable: ρ(ζ) has the zero ", rounded(root.real(), 5), " ± ",
           rounded(std::fabs(root.imag()), 5), " i of modulus ", rounded(std::abs(root), 6),
           " > 1, so errors grow like its powers. The formulas with 1 to 6 steps are stable (Cryer 1972)"));
}

}  // namespace pendula::integrate
