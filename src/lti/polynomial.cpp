#include "lti/polynomial.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::lti {
namespace {

bool vanishes(Expr e) { return e.is_constant() ? e.is_zero() : generic::is_zero(e); }

Polynomial trimmed(Polynomial p) {
  while (!p.empty() && p.back().is_zero()) p.pop_back();
  return p;
}

/// The degree of gcd(a, b) at a random point modulo a prime, which almost surely is that of the gcd
/// with symbolic coefficients.
std::size_t generic_gcd_size(const Polynomial& a, const Polynomial& b) {
  Polynomial both = a;
  both.insert(both.end(), b.begin(), b.end());
  const auto values = generic::residues(both);
  std::vector<generic::Residue> p(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(a.size())),
      q(values.begin() + static_cast<std::ptrdiff_t>(a.size()), values.end());
  const auto trim = [](auto& r) {
    while (!r.empty() && r.back().is_zero()) r.pop_back();
  };
  trim(p);
  trim(q);
  while (!q.empty()) {
    while (p.size() >= q.size()) {
      const auto factor = p.back() / q.back();
      const std::size_t shift = p.size() - q.size();
      for (std::size_t i = 0; i < q.size(); ++i) p[shift + i] = p[shift + i] - factor * q[i];
      p.pop_back();
      trim(p);
    }
    std::swap(p, q);
  }
  return p.size();
}

Polynomial monic(const Polynomial& p) {
  if (p.empty() || p.back().is_one()) return p;
  return tidy(scaled(1 / p.back(), p));
}

/// p and p′ at s in extended precision.
std::pair<std::complex<long double>, std::complex<long double>> value_and_slope(const std::vector<double>& p,
                                                                                std::complex<long double> s) {
  std::complex<long double> v = 0, d = 0;
  for (std::size_t k = p.size(); k-- > 0;) {
    d = d * s + v;
    v = v * s + static_cast<long double>(p[k]);
  }
  return {v, d};
}

double distance_to_others(const Eigen::VectorXcd& zeros, Index i) {
  double least = INFINITY;
  for (Index j = 0; j < zeros.size(); ++j)
    if (j != i) least = std::min(least, std::abs(zeros[j] - zeros[i]));
  return least;
}

/// Newton's method from an eigenvalue that may have lost all its digits next to much larger ones (1 - 10⁸ s +
/// s²: 7.5e-9 instead of 1e-8). The result is accepted if it is nearer than a third of the distance to the
/// next eigenvalue; otherwise the start is returned.
std::complex<long double> isolated_zero(const std::vector<double>& p, std::complex<long double> start,
                                        double distance) {
  const auto allowed = static_cast<long double>(distance) / 3;
  auto s = start;
  // from a factor of 10⁶ away on, steps first shrink by 1 - 1/n each; then Newton's method squares the error,
  // so that 10⁻⁶ is enough for the steps that follow
  constexpr int most = 40;
  constexpr long double settled = 1e-6L;
  for (int step = 0; step < most; ++step) {
    const auto [v, d] = value_and_slope(p, s);
    if (std::abs(d) == 0) return start;
    const auto change = v / d;
    s -= change;
    if (!(std::abs(s - start) < allowed)) return start;
    if (std::abs(change) <= settled * std::abs(s)) return s;
  }
  return start;
}

/// Zeros of a polynomial with nonzero end coefficients: eigenvalues of the companion matrix in the variable
/// s/σ, where σ is the geometric mean of their moduli; refined by Newton's method.
std::vector<Complex> numeric_zeros(std::vector<double> p) {
  const auto n = static_cast<Index>(p.size()) - 1;
  if (n < 1) return {};
  const double sigma = std::pow(std::fabs(p.front() / p.back()), 1.0 / static_cast<double>(n));
  Mat companion = Mat::Zero(n, n);
  double scale = 1;
  for (Index i = n; i-- > 0;) {
    scale *= sigma;
    companion(i, n - 1) = -p[i] / p.back() / scale;
    if (i > 0) companion(i, i - 1) = 1;
  }
  if (!companion.allFinite())
    throw Failure("the coefficients of the polynomial differ too much in size to find its zeros");
  const Eigen::EigenSolver<Mat> solver(companion, false);
  if (solver.info() != Eigen::Success)
    throw Failure("the iteration for the zeros of a polynomial did not converge");
  std::vector<Complex> list;
  for (Index i = 0; i < n; ++i) {
    std::complex<long double> s =
        std::complex<long double>(solver.eigenvalues()[i]) * static_cast<long double>(sigma);
    if (s.imag() < 0) continue;
    s = isolated_zero(p, s, distance_to_others(solver.eigenvalues(), i) * sigma);
    // an error of 10⁻³ is 10⁻²⁴ after three steps; multiple zeros converge linearly and stay as they are
    constexpr int most = 10;
    constexpr long double nearby = 1e-3L, last_bit = 1e-19L;  // of long double: 2⁻⁶³
    for (int step = 0; step < most; ++step) {
      const auto [v, d] = value_and_slope(p, s);
      if (std::abs(d) == 0) break;
      const auto change = v / d;
      if (!(std::abs(change) < nearby * std::abs(s))) break;  // do not leave the neighbourhood of the zero
      s -= change;
      if (std::abs(change) < last_bit * std::abs(s)) break;
    }
    list.emplace_back(static_cast<double>(s.real()), static_cast<double>(s.imag()));
    if (solver.eigenvalues()[i].imag() > 0) list.push_back(std::conj(list.back()));
  }
  return list;
}

}  // namespace

Polynomial tidy(Polynomial p) {
  for (Expr& c : p)
    if (!c.is_constant() && !c.is_symbol()) c = simplify(c);
  while (!p.empty() && vanishes(p.back())) p.pop_back();
  return p;
}

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
  Polynomial c(std::max(a.size(), b.size()));
  for (std::size_t k = 0; k < c.size(); ++k)
    c[k] = (k < a.size() ? a[k] : Expr(0)) + (k < b.size() ? b[k] : Expr(0));
  return tidy(std::move(c));
}

Polynomial operator-(const Polynomial& a, const Polynomial& b) { return a + scaled(-1, b); }

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  if (a.empty() || b.empty()) return {};
  Polynomial c(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) c[i + j] += a[i] * b[j];
  return tidy(std::move(c));
}

Polynomial scaled(Expr factor, Polynomial p) {
  for (Expr& c : p) c = factor * c;
  return trimmed(std::move(p));
}

Polynomial power(const Polynomial& p, int n) {
  Polynomial result{1};
  for (int k = 0; k < n; ++k) result = result * p;
  return result;
}

Expr expression(const Polynomial& p, Expr s) {
  Expr sum = 0;
  for (std::size_t k = p.size(); k-- > 0;)
    if (!p[k].is_zero()) sum += p[k] * (k == 0 ? Expr(1) : k == 1 ? s : pow(s, Expr(static_cast<long>(k))));
  return sum;
}

Complex value(const std::vector<double>& p, Complex s) {
  Complex sum = 0;
  for (std::size_t k = p.size(); k-- > 0;) sum = sum * s + p[k];
  return sum;
}

std::vector<double> numbers(const Polynomial& p) {
  std::vector<double> values;
  for (Expr c : p) values.push_back(number(c));
  return values;
}

dae::Polynomial rational(const Polynomial& p) {
  dae::Polynomial q;
  for (Expr c : p) q.push_back(exact_value(c) ? *exact_value(c) : mpq_class(constant_value(c)));
  return q;
}

Polynomial expressions(const dae::Polynomial& p) {
  Polynomial q;
  for (const mpq_class& c : p) q.push_back(Expr(c));
  return q;
}

Quotient divide(const Polynomial& a, const Polynomial& b) {
  PENDULA_ASSERT(!b.empty(), "division by the zero polynomial");
  Quotient d;
  d.remainder = a;
  if (a.size() >= b.size()) d.quotient.resize(a.size() - b.size() + 1);
  for (std::size_t k = d.quotient.size(); k-- > 0;) {
    if (d.remainder.size() < k + b.size()) continue;
    Expr factor = d.remainder.back() / b.back();
    if (!factor.is_constant()) factor = simplify(factor);
    d.quotient[k] = factor;
    for (std::size_t i = 0; i + 1 < b.size(); ++i) d.remainder[k + i] -= factor * b[i];
    d.remainder.pop_back();
    d.remainder = tidy(std::move(d.remainder));
  }
  d.quotient = trimmed(std::move(d.quotient));
  return d;
}

Polynomial gcd(const Polynomial& a, const Polynomial& b) {
  if (a.empty() || b.empty()) return monic(a.empty() ? b : a);
  if (a.size() == 1 || b.size() == 1) return {1};
  const Field f = common(field(a), field(b));
  if (f == Field::numeric) return {1};
  if (f == Field::exact) return expressions(dae::gcd(rational(a), rational(b)));
  const std::size_t size = generic_gcd_size(a, b);
  if (size <= 1) return {1};
  Polynomial p = a, q = b;
  if (p.size() < q.size()) std::swap(p, q);
  while (!q.empty() && p.size() > size) {
    Polynomial r = monic(divide(p, q).remainder);
    p = std::move(q);
    q = std::move(r);
  }
  return monic(p);
}

std::vector<dae::Mode> zeros(const Polynomial& given) {
  PENDULA_ASSERT(!given.empty(), "the zeros of the zero polynomial");
  constexpr int most_exact = 40;  // the states of exact transfer functions
  if (field(given) == Field::exact && degree(given) <= most_exact)
    return dae::modes(dae::factors(rational(given)));
  std::vector<dae::Mode> list;
  std::vector<double> p = numbers(given);
  int at_zero = 0;
  while (p.size() > 1 && p.front() == 0) {
    p.erase(p.begin());
    ++at_zero;
  }
  if (at_zero) list.push_back({0.0, at_zero, std::pair(Expr(0), Expr(0))});
  for (const Complex& z : numeric_zeros(std::move(p))) list.push_back({z, 1, {}});
  std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) {
    return std::pair(a.value.real(), a.value.imag()) < std::pair(b.value.real(), b.value.imag());
  });
  return list;
}

Polynomial from_zeros(const std::vector<std::pair<Expr, Expr>>& zeros) {
  Polynomial p{1}, q;  // p + i q
  for (const auto& [re, im] : zeros) {
    Polynomial linear{-re, 1}, next = p * linear + scaled(im, q);
    q = q * linear - scaled(im, p);
    p = std::move(next);
  }
  return p;
}

Fraction cancelled(const Fraction& f) {
  if (f.num.empty()) return {{}, {1}};
  const Polynomial common_factor = gcd(f.num, f.den);
  Fraction g{f.num, f.den};
  if (degree(common_factor) > 0)
    g = {divide(f.num, common_factor).quotient, divide(f.den, common_factor).quotient};
  if (!g.den.back().is_one()) {
    const Expr factor = 1 / g.den.back();
    g.num = tidy(scaled(factor, g.num));
    g.den = tidy(scaled(factor, g.den));
    g.den.back() = 1;
  }
  return g;
}

Fraction sum(const Fraction& a, const Fraction& b) {
  if (a.num.empty()) return b;
  if (b.num.empty()) return a;
  if (a.den == b.den) return {a.num + b.num, a.den};
  const Polynomial g = gcd(a.den, b.den);
  if (degree(g) < 1) return {a.num * b.den + b.num * a.den, a.den * b.den};
  const Polynomial of_a = divide(a.den, g).quotient, of_b = divide(b.den, g).quotient;
  return {a.num * of_b + b.num * of_a, a.den * of_b};
}

Fraction product(const Fraction& a, const Fraction& b) {
  if (a.num.empty() || b.num.empty()) return {{}, {1}};
  return {a.num * b.num, a.den * b.den};
}

// ── text ──

namespace {

std::string power_text(const std::string& s, int k, bool latex) {
  if (k == 0) return "";
  if (k == 1) return s;
  return latex ? text(s, "^{", k, "}") : s + superscript(k);
}

std::string coefficient_text(Expr c, bool latex) { return latex ? to_latex(c) : pendula::to_text(c); }

std::string with_power(const std::string& words, const std::string& p) {
  return p.empty() ? words : words + " " + p;
}

bool is_sum(const std::string& words) {
  int depth = 0;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const char c = words[i];
    if (c == '(' || c == '{' || c == '[') ++depth;
    if (c == ')' || c == '}' || c == ']') --depth;
    if (depth == 0 && i > 0 && c == ' ' &&
        (words.compare(i, 3, " + ") == 0 || words.compare(i, 3, " - ") == 0))
      return true;
  }
  return false;
}

/// One term with its sign in front.
std::string term_text(Expr c, const std::string& variable, int k, bool latex, bool decimals) {
  const std::string p = power_text(variable, k, latex);
  if (decimals && !c.is_one() && c != Expr(-1)) {
    const std::string number = pendula::rounded(constant_value(c));
    // equal to 1 after rounding: s instead of 1 s
    const bool one = k > 0 && (number == "1" || number == "-1");
    return one ? (number == "1" ? p : "-" + p) : with_power(number, p);
  }
  std::string words = coefficient_text(c, latex);
  if (k == 0) return is_sum(words) && words[0] == '-' ? "(" + words + ")" : words;
  if (c.is_one()) return p;
  if (c == Expr(-1)) return "-" + p;
  const bool quotient = words.find('/') != std::string::npos;
  if (is_sum(words) || (quotient && !c.is_constant()))
    return (words[0] == '-' && !is_sum(words) ? "-(" + words.substr(1) : (latex ? "\\left(" : "(") + words) +
           (latex && is_sum(words) ? "\\right) " : ") ") + p;
  if (quotient) {  // s/2 instead of 1/2 s
    const Expr symbol = pendula::symbol(Kind::parameter, variable);
    return coefficient_text(c * (k == 1 ? symbol : pow(symbol, Expr(static_cast<long>(k)))), latex);
  }
  return words + " " + p;
}

}  // namespace

std::string to_text(const Polynomial& p, const std::string& variable, bool latex) {
  std::string out;
  const bool decimals = field(std::span<const Expr>(p)) == Field::numeric;
  for (int k = degree(p); k >= 0; --k) {
    const Expr c = p[k];
    if (c.is_zero()) continue;
    const std::string term = term_text(c, variable, k, latex, decimals);
    if (out.empty())
      out = term;
    else
      out += term[0] == '-' ? " - " + term.substr(1) : " + " + term;
  }
  return out.empty() ? "0" : out;
}

std::vector<std::string> lines(const std::string& above, const std::string& below) {
  if (below == "1") return {above};
  const int width = std::max(display_width(above), display_width(below));
  const auto centred = [&](const std::string& words) {
    return std::string(static_cast<std::size_t>((width - display_width(words)) / 2), ' ') + words;
  };
  std::string rule;
  for (int k = 0; k < width; ++k) rule += "─";
  return {centred(above), rule, centred(below)};
}

}  // namespace pendula::lti
