#include "method/stability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/search/golden_section.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "method/order_conditions.hpp"

namespace pendula::integrate {
namespace {

using Complex = std::complex<double>;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// det(I - zM) by powers of z: the characteristic polynomial reversed (Faddeev-LeVerrier). `at(i, j)` is M.
template <class Number, class Entry>
std::vector<Number> reversed_characteristic(int s, const Number& zero, const Number& one, const Entry& at) {
  std::vector<Number> result = {one}, M, power(static_cast<std::size_t>(s) * s, zero);
  const auto cell = [s](int i, int j) { return static_cast<std::size_t>(i) * s + j; };
  for (int i = 0; i < s; ++i) {
    for (int j = 0; j < s; ++j) M.push_back(at(i, j));
    power[cell(i, i)] = one;
  }
  for (int k = 1; k <= s; ++k) {
    std::vector<Number> product(power.size(), zero);
    Number trace = zero, divisor = zero;
    for (int i = 0; i < s; ++i) {
      poll_interrupt();
      for (int j = 0; j < s; ++j)
        for (int l = 0; l < s; ++l) product[cell(i, j)] += M[cell(i, l)] * power[cell(l, j)];
      trace += product[cell(i, i)];
    }
    for (int i = 0; i < k; ++i) divisor += one;
    Number coefficient = zero;
    coefficient -= trace / divisor;
    for (int i = 0; i < s; ++i) product[cell(i, i)] += coefficient;
    result.push_back(coefficient);
    power = std::move(product);
  }
  return result;
}

/// The simplest fraction within `tolerance` of the value, if it is simple enough to be the intended one;
/// else the value.
Surd recognised(const Real& value, double tolerance, bool& exact) {
  if (abs(value) <= tolerance) return {};
  const mpq_class v(value);
  mpz_class p0 = 1, q0 = 0, p1 = 0, q1 = 1;
  mpq_class rest = v;
  // There are q² fractions with denominators to q: that one lies within the tolerance by chance has a
  // probability of q² tolerance, here 2⁻¹⁶ at most. A value of 256 bits has some 150 convergents.
  constexpr double by_chance = -16;
  constexpr int most = 2000;
  for (int i = 0; i < most; ++i) {
    mpz_class floor;
    mpz_fdiv_q(floor.get_mpz_t(), rest.get_num().get_mpz_t(), rest.get_den().get_mpz_t());
    mpz_class p = floor * p0 + p1, q = floor * q0 + q1;
    p1 = p0;
    q1 = q0;
    p0 = p;
    q0 = q;
    const mpq_class candidate(p0, q0);
    if (abs(candidate - v) <= tolerance) {
      const double bits = 2.0 * static_cast<double>(mpz_sizeinbase(q0.get_mpz_t(), 2)) + std::log2(tolerance);
      if (bits < by_chance) return Surd(candidate);
      break;
    }
    rest -= floor;
    if (rest == 0) break;
    rest = 1 / rest;
  }
  exact = false;
  return Surd(v);
}

mpq_class factorial(int n) {
  mpz_class result = 1;
  for (int i = 2; i <= n; ++i) result *= i;
  return result;
}

/// The coefficient of z^k in Q(z) e^z.
Surd exponential_part(const Polynomial& Q, int k) {
  Surd sum;
  for (int j = 0; j <= k && j < static_cast<int>(Q.size()); ++j) sum += Q[j] * Surd(1 / factorial(k - j));
  return sum;
}

/// |p(iy)|² as a polynomial in w = y².
Polynomial modulus_on_axis(const Polynomial& p) {
  Polynomial even, odd;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const bool negative = k % 4 >= 2;
    (k % 2 ? odd : even).push_back(negative ? -p[k] : p[k]);
  }
  Polynomial square = times(odd, odd);
  if (!square.empty()) square.insert(square.begin(), Surd());
  return plus(times(even, even), square);
}

Polynomial reflected(const Polynomial& p) {  // p(-x)
  Polynomial result = p;
  for (std::size_t k = 1; k < p.size(); k += 2) result[k] = -result[k];
  return result;
}

std::vector<Complex> companion_zeros(const std::vector<Complex>& c) {  // by increasing power
  auto n = static_cast<Eigen::Index>(c.size()) - 1;
  while (n > 0 && std::abs(c[n]) == 0) --n;
  if (n < 1) return {};
  Eigen::MatrixXcd M = Eigen::MatrixXcd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) M(0, i) = -c[n - 1 - i] / c[n];
  for (Eigen::Index i = 1; i < n; ++i) M(i, i - 1) = 1;
  const Eigen::VectorXcd values = Eigen::ComplexEigenSolver<Eigen::MatrixXcd>(M, false).eigenvalues();
  return {values.data(), values.data() + values.size()};
}

std::vector<double> doubles(const Polynomial& p) {
  std::vector<double> result;
  for (const Surd& c : p) result.push_back(c.value());
  return result;
}

/// first_sign_change for rounded coefficients, whose fractions would grow: brackets between the approximate
/// zeros, signs to 256 bits.
std::optional<double> first_numeric_sign_change(const Polynomial& p) {
  std::size_t first = 0;
  while (first < p.size() && p[first].is_zero()) ++first;
  std::vector<Complex> c;
  std::vector<Real> reals;
  for (std::size_t k = first; k < p.size(); ++k) {
    c.emplace_back(p[k].value());
    reals.push_back(p[k].real(256));
  }
  if (c.size() < 2) return {};
  constexpr double nearly_real = 1e-5;  // a triple zero is computed with an error of ∛ε = 6e-6
  std::vector<double> edges = {0};
  for (Complex z : companion_zeros(c))
    if (z.real() > 0 && std::fabs(z.imag()) < nearly_real * std::abs(z)) edges.push_back(z.real());
  std::sort(edges.begin(), edges.end());
  edges.push_back(2 * edges.back() + 1);
  const auto sign = [&](const Real& x) {
    Real sum(0, 256);
    for (std::size_t k = reals.size(); k-- > 0;) sum = sum * x + reals[k];
    return sgn(sum);
  };
  const int start = sgn(reals[0]);
  Real low(0, 256);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    Real high((edges[i - 1] + edges[i]) / 2, 256);
    if (sign(high) != start) {
      constexpr int halvings = 120;  // 53 bits of a double, and 67 if the interval is wide
      for (int step = 0; step < halvings; ++step) {
        const Real middle((low + high) / 2, 256);
        (sign(middle) == start ? low : high) = middle;
      }
      return nearest_double(high);
    }
    low = high;
  }
  return {};
}

std::optional<double> sign_change(const Polynomial& p, bool exact) {
  return exact ? first_sign_change(p) : first_numeric_sign_change(p);
}

struct Rational {
  Polynomial P, Q;
  bool exact = true;
  double tolerance = 0;  ///< of a coefficient, if not exact
};

/// Collocation: P = Σ M^(s-j)(1) zʲ, Q = Σ M^(s-j)(0) zʲ with M(x) = ∏(x - cᵢ)/s!
/// (Thm IV.3.10); s² operations.
Rational from_nodes(const Coefficients& rk) {
  const int s = rk.stages();
  RealVector M(1, Real(1, rk.bits));  // by increasing power
  for (const Real& c : rk.c) {
    M.push_back(Real(0, rk.bits));
    for (std::size_t k = M.size(); k-- > 0;) M[k] = (k > 0 ? M[k - 1] : Real(0, rk.bits)) - c * M[k];
  }
  Rational R;
  R.tolerance = rk.unit;
  for (int j = 0; j <= s; ++j) {  // M^(n)(x) = Σ k!/(k-n)! Mₖ x^(k-n), n = s - j
    Real at_one(0, rk.bits), at_zero(0, rk.bits);
    Real falling(1, rk.bits);
    for (int k = s - j; k <= s; ++k) {
      if (k == s - j)
        for (int i = 2; i <= k; ++i) falling *= i;
      else
        falling = falling * k / (k - (s - j));
      if (k == s - j) at_zero = falling * M[k];
      at_one += falling * M[k];
    }
    for (int i = 2; i <= s; ++i) {
      at_one /= i;
      at_zero /= i;
    }
    R.P.push_back(recognised(at_one, rk.unit, R.exact));
    R.Q.push_back(recognised(at_zero, rk.unit, R.exact));
  }
  return R;
}

Rational from_reals(const RealMatrix& A, const RealVector& b, mp_bitcnt_t bits, double unit, int order) {
  const int s = A.size();
  const Real zero(0, bits), one(1, bits);
  // typed coefficients of 16 digits, products of s of them: a factor of 1000 is a choice
  constexpr double typed = 0x1p-120;
  const double tolerance = unit > typed ? 1e3 * unit : unit;
  const auto p =
      reversed_characteristic<Real>(s, zero, one, [&](int i, int j) { return Real(A(i, j) - b[j]); });
  const auto q = reversed_characteristic<Real>(s, zero, one, [&](int i, int j) { return A(i, j); });
  Rational R;
  R.tolerance = tolerance;
  for (const Real& c : q) R.Q.push_back(recognised(c, tolerance, R.exact));
  // the order is proved, so these coefficients of P are exact
  for (int k = 0; k <= s; ++k) {
    Surd proved = exponential_part(R.Q, k);
    if (!R.exact && std::fabs(proved.value()) <= tolerance) proved = Surd();
    R.P.push_back(k <= order ? proved : recognised(p[k], tolerance, R.exact));
  }
  constexpr std::size_t readable = 40;  // bits of a denominator, 12 digits; longer ones are doubles
  if (unit > typed && order < s)
    R.exact = R.exact && std::all_of(R.P.begin(), R.P.end(), [](const Surd& c) {
                return mpz_sizeinbase(c.rational_part().get_den().get_mpz_t(), 2) < readable;
              });
  return R;
}

}  // namespace

Stability::Stability(const Tableau& rk) {
  if (const auto exact = exact_coefficients(rk)) {
    const int s = rk.stages();
    const auto at = [&](int i, int j) { return exact->a(i, j); };
    Q_ = reversed_characteristic<Surd>(s, Surd(), Surd(1), at);
    P_ = reversed_characteristic<Surd>(s, Surd(), Surd(1),
                                       [&](int i, int j) { return at(i, j) - exact->b[j]; });
    exact_ = true;
  } else {
    const Coefficients& c = rk.coefficients();
    Rational R = rk.is_collocation() ? from_nodes(c) : from_reals(c.A, c.b, c.bits, c.unit, rk.order());
    P_ = std::move(R.P);
    Q_ = std::move(R.Q);
    exact_ = R.exact;
    tolerance_ = R.tolerance;
  }
  finish(rk.order());
}

Stability::Stability(const Rosenbrock& method) {
  Rational R = from_reals(method.real_beta(), method.real_b(), 256, method.unit(), method.order());
  P_ = std::move(R.P);
  Q_ = std::move(R.Q);
  exact_ = R.exact;
  tolerance_ = R.tolerance;
  finish(method.order());
}

namespace {
constexpr int largest_reducible = 24;  ///< only methods typed by users have common factors
}

void Stability::finish(int order) {
  trim(P_);
  trim(Q_);
  if (exact_ && degree(Q_) <= largest_reducible) {
    const Polynomial common = greatest_common_divisor(P_, Q_);
    if (degree(common) > 0) {
      P_ = divide(P_, common).quotient;
      Q_ = divide(Q_, common).quotient;
      const Surd scale = Q_[0];
      for (Polynomial* p : {&P_, &Q_})
        for (Surd& c : *p) c = c / scale;
    }
  }
  const int highest = degree(P_) + degree(Q_);  // of Padé approximants
  for (order_ = order;; ++order_) {
    const std::size_t k = static_cast<std::size_t>(order_) + 1;
    error_constant_ = exponential_part(Q_, order_ + 1) - (k < P_.size() ? P_[k] : Surd());
    if (order_ >= highest) break;  // the constant may be smaller than the tolerance
    if (!(exact_ ? error_constant_.is_zero() : std::fabs(error_constant_.value()) <= tolerance_)) break;
  }
  Polynomial axis = minus(modulus_on_axis(Q_), modulus_on_axis(P_));
  // |R(iy)| = 1 + O(y^(p+1)): lower powers are rounding errors
  for (std::size_t k = 0; !exact_ && 2 * static_cast<int>(k) <= order && k < axis.size(); ++k)
    axis[k] = Surd();
  trim(axis);
  const auto crossing = sign_change(axis, exact_);
  const bool stable_axis = axis.empty() || (axis.back().sign() > 0 && !crossing);
  const auto lowest = std::find_if(axis.begin(), axis.end(), [](const Surd& c) { return !c.is_zero(); });
  imaginary_ = stable_axis ? infinity : lowest->sign() < 0 ? 0 : crossing ? std::sqrt(*crossing) : infinity;
  const Polynomial p = reflected(P_), q = reflected(Q_);  // on x = -t
  a_stable_ = stable_axis && degree(P_) <= degree(Q_) && is_hurwitz(q);
  const auto edge = a_stable_ ? std::nullopt : sign_change(minus(times(q, q), times(p, p)), exact_);
  real_ = edge ? -*edge : -infinity;
  alpha_ = a_stable_ ? 90 : sector();
}

double Stability::at_infinity() const {
  if (degree(P_) < degree(Q_)) return 0;
  const double ratio = (P_.back() / Q_.back()).value();
  return degree(P_) == degree(Q_) ? ratio : std::copysign(infinity, ratio);
}

Complex Stability::operator()(Complex z) const {
  Complex p = 0, q = 0;
  for (std::size_t k = P_.size(); k-- > 0;) p = p * z + P_[k].value();
  for (std::size_t k = Q_.size(); k-- > 0;) q = q * z + Q_[k].value();
  return p / q;
}

// The stable sector ends at the first boundary point: the smallest |arg(-z)| of the zeros of P - e^{iφ}Q in
// the left half-plane, on a grid of φ refined by golden section.
double Stability::sector() const {
  if (degree(P_) > degree(Q_) || std::fabs(at_infinity()) > 1 || std::isfinite(real_)) return 0;
  constexpr int samples = 4000;      // 0.05° apart on the unit circle
  constexpr double rounding = 1e-7;  // double zeros on the axis err by √ε
  constexpr double pi = std::numbers::pi;
  const std::vector<double> p = doubles(P_), q = doubles(Q_);
  const auto angle = [&](double phi) {
    std::vector<Complex> c(std::max(p.size(), q.size()), 0.0);
    for (std::size_t k = 0; k < p.size(); ++k) c[k] += p[k];
    for (std::size_t k = 0; k < q.size(); ++k) c[k] -= std::polar(1.0, phi) * q[k];
    double best = pi / 2;
    for (Complex z : companion_zeros(c))
      if (z.real() < -rounding * (1 + std::abs(z)))
        best = std::min(best, std::atan2(std::fabs(z.imag()), -z.real()));
    return best;
  };
  double best = pi / 2, where = 0;
  for (int i = 1; i <= samples; ++i) {
    poll_interrupt();
    const double phi = pi * i / samples, at = angle(phi);
    if (at < best) {
      best = at;
      where = phi;
    }
  }
  if (best < pi / 2)
    where =
        golden_section(angle, where - pi / samples, where + pi / samples, 60).middle();  // 0.618⁶⁰ = 3e-13
  return std::min(best, angle(where)) * 180 / pi;
}

Expr Stability::numerator(Expr z) const {
  Expr sum;
  for (std::size_t k = 0; k < P_.size(); ++k) sum += P_[k].expr() * pow(z, Expr(static_cast<long>(k)));
  return sum;
}

Expr Stability::denominator(Expr z) const {
  Expr sum;
  for (std::size_t k = 0; k < Q_.size(); ++k) sum += Q_[k].expr() * pow(z, Expr(static_cast<long>(k)));
  return sum;
}

std::vector<Complex> Stability::boundary(int angles) const {
  const std::vector<double> p = doubles(P_), q = doubles(Q_);
  const auto roots_at = [&](int i) {
    std::vector<Complex> c(std::max(p.size(), q.size()), 0.0);
    const Complex turn = std::polar(1.0, 2 * std::numbers::pi * i / angles);
    for (std::size_t k = 0; k < p.size(); ++k) c[k] += p[k];
    for (std::size_t k = 0; k < q.size(); ++k) c[k] -= turn * q[k];
    return companion_zeros(c);
  };
  std::vector<std::vector<Complex>> arcs;
  for (Complex z : roots_at(0)) arcs.push_back({z});
  for (int i = 1; i <= angles; ++i) {
    std::vector<Complex> roots = roots_at(i);
    for (auto& arc : arcs) {  // continue each arc to the nearest remaining zero
      const auto nearest = std::min_element(roots.begin(), roots.end(), [&](Complex a, Complex b) {
        return std::abs(a - arc.back()) < std::abs(b - arc.back());
      });
      if (nearest == roots.end()) continue;
      arc.push_back(*nearest);
      roots.erase(nearest);
    }
  }
  // an arc ends where another begins, so that together they form closed curves
  std::vector<Complex> points;
  std::vector<bool> used(arcs.size(), false);
  for (std::size_t first = 0; first < arcs.size(); ++first) {
    if (used[first]) continue;
    if (!points.empty()) points.emplace_back(std::nan(""), std::nan(""));
    for (std::size_t at = first; !used[at];) {
      used[at] = true;
      points.insert(points.end(), arcs[at].begin(), arcs[at].end());
      const auto next = std::min_element(arcs.begin(), arcs.end(), [&](const auto& x, const auto& y) {
        return std::abs(x[0] - arcs[at].back()) < std::abs(y[0] - arcs[at].back());
      });
      at = static_cast<std::size_t>(next - arcs.begin());
    }
  }
  return points;
}

}  // namespace pendula::integrate
