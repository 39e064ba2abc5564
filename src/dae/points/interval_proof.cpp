#include "dae/points/interval_proof.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "expr/graph/derivative.hpp"

namespace pendula::dae {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double largest = std::numeric_limits<double>::max();
constexpr double farthest = 1e300;  ///< no solution beyond: most expressions in the unknown would overflow

struct Interval {
  double lo = -infinite, hi = infinite;
  bool contains(double v) const { return lo <= v && v <= hi; }
  bool is_bounded() const { return std::isfinite(lo) && std::isfinite(hi); }
  /// No number lies in it.
  bool is_empty() const { return !(lo <= hi) || lo == infinite || hi == -infinite; }
};

constexpr Interval never{0, 0}, always{1, 1}, perhaps{0, 1};  // truth values

Interval intersection(Interval a, Interval b) { return {std::max(a.lo, b.lo), std::min(a.hi, b.hi)}; }
Interval hull(Interval a, Interval b) { return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)}; }
bool are_apart(Interval a, Interval b) { return a.hi < b.lo || b.hi < a.lo; }

/// Rounds outward by 9 ε: functions of glibc err by at most 2 units in the last place, arithmetic by ½.
/// Overflow yields a number beyond the largest double. 0 stays exact, for sums as well as for the functions
/// used here; underflow does not become 0 (`not_zero`).
Interval outward(double lo, double hi) {
  constexpr double error = 2e-15;
  const auto down = [](double v) {
    if (v == infinite) return largest;
    return v == 0 || !std::isfinite(v) ? v : std::nextafter(v - error * std::fabs(v), -infinite);
  };
  return {down(lo), -down(-hi)};
}
double not_zero(double underflown, bool negative) {
  constexpr double least = std::numeric_limits<double>::denorm_min();
  return underflown != 0 ? underflown : negative ? -least : least;
}
constexpr Interval empty{1, -1};
Interval not_negative(Interval a) { return {std::max(a.lo, 0.0), a.hi}; }

Interval operator+(Interval a, Interval b) { return outward(a.lo + b.lo, a.hi + b.hi); }
Interval operator-(Interval a) { return {-a.hi, -a.lo}; }
Interval operator-(Interval a, Interval b) { return a + -b; }

Interval operator*(Interval a, Interval b) {
  const auto product = [](double x, double y) {
    return x == 0 || y == 0 ? 0.0 : not_zero(x * y, (x < 0) != (y < 0));
  };
  const auto [lo, hi] =
      std::minmax({product(a.lo, b.lo), product(a.lo, b.hi), product(a.hi, b.lo), product(a.hi, b.hi)});
  return outward(lo, hi);
}

/// All q for which q b lies in a for some b ≠ 0.
Interval operator/(Interval a, Interval b) {
  if (b.lo == 0 && b.hi == 0) return empty;
  if (b.lo < 0 && b.hi > 0) return {};
  if (b.lo == 0) return a * Interval{b.hi == infinite ? 0 : outward(1 / b.hi, 0).lo, infinite};
  if (b.hi == 0) return a * Interval{-infinite, b.lo == -infinite ? 0 : outward(0, 1 / b.lo).hi};
  return a * outward(1 / b.hi, 1 / b.lo);
}

template <class F>
Interval increasing(F f, Interval a) {
  return outward(f(a.lo), f(a.hi));
}

/// For a function that is defined between `lo` and `hi` only and unbounded there.
template <class F>
Interval increasing_between(F f, double lo, double hi, Interval a) {
  if (a.hi <= lo || a.lo >= hi) return empty;
  return outward(a.lo <= lo ? -infinite : f(a.lo), a.hi >= hi ? infinite : f(a.hi));
}
Interval exponential(Interval a) {
  return not_negative(increasing([](double v) { return not_zero(std::exp(v), false); }, a));
}
Interval logarithm(Interval a) {
  return increasing_between([](double v) { return std::log(v); }, 0, infinite, a);
}

Interval absolute(Interval a) {
  if (a.lo >= 0) return a;
  if (a.hi <= 0) return -a;
  return {0, std::max(-a.lo, a.hi)};
}

/// cos on an interval: 1 and -1 where it contains multiples of π.
Interval cosine(Interval a) {
  constexpr double pi = std::numbers::pi;
  constexpr double most = 1e6, angle = 1e-9;  // up to `most`, multiples of π err by 1e6 ε < angle
  constexpr double rounding = 1e-15;          // near a zero of cos, of the reduced argument: 4 ε
  if (!a.is_bounded() || a.hi - a.lo >= 2 * pi || absolute(a).hi > most) return {-1, 1};
  const auto contains = [&](double first) {
    return std::floor((a.hi + angle - first) / (2 * pi)) >= std::ceil((a.lo - angle - first) / (2 * pi));
  };
  const Interval ends = outward(std::min(std::cos(a.lo), std::cos(a.hi)) - rounding,
                                std::max(std::cos(a.lo), std::cos(a.hi)) + rounding);
  return {contains(pi) ? -1 : std::max(ends.lo, -1.0), contains(0) ? 1 : std::min(ends.hi, 1.0)};
}

Interval power(Interval a, double n) {
  const auto f = [n](double v) {
    return v == 0 ? 0.0 : not_zero(std::pow(v, n), v < 0 && std::fmod(n, 2) != 0);
  };
  if (n < 0) return Interval{1, 1} / power(a, -n);
  if (n != std::round(n)) return not_negative(increasing(f, not_negative(a)));
  return std::fmod(n, 2) == 0 ? not_negative(increasing(f, absolute(a))) : increasing(f, a);
}

/// The numbers within `now` whose n-th power lies in r.
Interval root(Interval r, double n, Interval now) {
  const auto f = [n](double v) { return std::copysign(std::pow(std::fabs(v), 1 / n), v); };
  if (n < 0) return root(Interval{1, 1} / r, -n, now);
  if (n == std::round(n) && std::fmod(n, 2) != 0) return increasing(f, r);
  const Interval size = not_negative(increasing(f, not_negative(r)));
  if (r.hi < 0) return empty;
  if (n != std::round(n) || now.lo >= 0) return size;
  return now.hi <= 0 ? -size : Interval{-size.hi, size.hi};
}

// Number of rows up to which unbounded intervals are split. That seldom helps and takes 15 times as long; the
// limit is that of models whose index is determined from the derivative array.
constexpr std::size_t few = 12;

class Propagation {
 public:
  Propagation(std::span<const Expr> rows, const std::unordered_map<Expr, double>& known)
      : nodes_(topological(rows)) {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      const Expr e = nodes_[k];
      place_[e] = k;
      const auto it = known.find(e);
      value_.push_back(it != known.end() ? Interval{1 - 1e-12, 1 + 1e-12} * Interval{it->second, it->second}
                       : e.is_constant() ? outward(constant_value(e), constant_value(e))
                       : e == pi()       ? outward(std::numbers::pi, std::numbers::pi)
                                         : Interval{});
    }
    for (Expr row : rows) zero_.push_back(place_.at(row));
  }

  /// Splits unknowns whose interval contains 0 into a negative and a positive part, up to `depth` times.
  bool finds_empty(int depth) {
    if (propagation_empties()) return true;
    if (depth == 0) return false;
    const auto split = [&](std::size_t k) {
      const Interval v = value_[k];
      return nodes_[k].is_symbol() && v.lo < 0 && v.hi > 0 && v.hi - v.lo > narrow_around_0 &&
             (v.is_bounded() || zero_.size() <= few);
    };
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      if (!split(k)) continue;
      for (const Interval half : {Interval{value_[k].lo, 0}, Interval{0, value_[k].hi}}) {
        Propagation part = *this;
        part.value_[k] = half;
        if (!part.finds_empty(depth - 1)) return false;
      }
      return true;
    }
    return false;
  }

 private:
  /// Width below which an interval is not split: an unknown that is 0 has a narrow interval whose
  /// halves prove nothing.
  static constexpr double narrow_around_0 = 1e-6;

  bool propagation_empties() {
    constexpr int most_sweeps = 100;  // sweeps that shrink by `visible` leave 0.9 of an interval
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
      shrunk_ = false;
      for (std::size_t k = 0; k < nodes_.size(); ++k) narrow(k, forward(nodes_[k]));
      for (std::size_t k : zero_) narrow(k, {0, 0});
      for (std::size_t k = nodes_.size(); k-- > 0;) backward(nodes_[k]);
      if (empty_ || !shrunk_) return empty_;
    }
    return false;
  }

  Interval& of(Expr e) { return value_[place_.at(e)]; }

  void narrow(std::size_t k, Interval next) {
    // share of a bounded interval; halving it by smaller changes takes 700 sweeps
    constexpr double visible = 1e-3;
    Interval& now = value_[k];
    const Interval old = now;
    now = intersection(now, next);
    const bool beyond = nodes_[k].is_symbol() && (now.lo > farthest || now.hi < -farthest);
    empty_ = empty_ || now.is_empty() || beyond;
    const bool bounded = old.is_bounded();
    if (bounded ? now.hi - now.lo < (1 - visible) * (old.hi - old.lo) : now.lo > old.lo || now.hi < old.hi)
      shrunk_ = true;
  }
  void narrow(Expr e, Interval next) { narrow(place_.at(e), next); }

  Interval forward(Expr e) {
    const auto a = [&] { return of(e.operand(0)); };
    const auto b = [&] { return of(e.operand(1)); };
    switch (e.op()) {
      case Op::neg:
        return -a();
      case Op::add:
        return a() + b();
      case Op::sub:
        return e.operand(0) == e.operand(1) ? Interval{0, 0} : a() - b();
      case Op::mul:
        return e.operand(0) == e.operand(1) ? power(a(), 2) : a() * b();
      case Op::div:
        return a() / b();
      case Op::pow:
        return e.operand(1).is_constant() ? power(a(), constant_value(e.operand(1))) : Interval{};
      case Op::sin:
        return cosine(a() - outward(std::numbers::pi / 2, std::numbers::pi / 2));
      case Op::cos:
        return cosine(a());
      case Op::exp:
        return exponential(a());
      case Op::log:
        return logarithm(a());
      case Op::sqrt:
        return not_negative(increasing([](double v) { return std::sqrt(v); }, not_negative(a())));
      case Op::abs:
        return absolute(a());
      case Op::sinh:
        return increasing([](double v) { return std::sinh(v); }, a());
      case Op::cosh:
        return intersection({1, infinite}, increasing([](double v) { return std::cosh(v); }, absolute(a())));
      case Op::tanh:
        return intersection({-1, 1}, increasing([](double v) { return std::tanh(v); }, a()));
      case Op::atan:
        return increasing([](double v) { return std::atan(v); }, a());
      case Op::asinh:
        return increasing([](double v) { return std::asinh(v); }, a());
      case Op::asin:
        return increasing([](double v) { return std::asin(v); }, intersection(a(), {-1, 1}));
      case Op::acos:
        return {0, std::nextafter(std::numbers::pi, 4)};
      case Op::atan2:
        return {-std::nextafter(std::numbers::pi, 4), std::nextafter(std::numbers::pi, 4)};
      case Op::lt:
        return a().hi < b().lo ? always : a().lo >= b().hi ? never : perhaps;
      case Op::le:
        return a().hi <= b().lo ? always : a().lo > b().hi ? never : perhaps;
      case Op::both:
      case Op::either:
        return perhaps;
      case Op::ifelse:
        return is_true(a()) ? b() : is_false(a()) ? of(e.operand(2)) : hull(b(), of(e.operand(2)));
      case Op::sign:
        return {a().lo > 0 ? 1.0 : -1.0, a().hi < 0 ? -1.0 : 1.0};
      case Op::min:
        return {std::min(a().lo, b().lo), std::min(a().hi, b().hi)};
      case Op::max:
        return {std::max(a().lo, b().lo), std::max(a().hi, b().hi)};
      default:
        return {};
    }
  }

  void backward(Expr e) {
    if (e.operands().empty() || empty_) return;
    const Interval r = of(e);
    const Expr a = e.operand(0), b = e.operands().size() > 1 ? e.operand(1) : a;
    switch (e.op()) {
      case Op::neg:
        return narrow(a, -r);
      case Op::add:
        narrow(a, r - of(b));
        return narrow(b, r - of(a));
      case Op::sub:
        narrow(a, r + of(b));
        return narrow(b, of(a) - r);
      case Op::mul:
        if (a == b) return narrow(a, root(r, 2, of(a)));
        if (!(r.contains(0) && of(b).contains(0))) narrow(a, r / of(b));
        if (!(r.contains(0) && of(a).contains(0))) narrow(b, r / of(a));
        return;
      case Op::div:
        narrow(a, r * of(b));
        if (!(r.contains(0) && of(a).contains(0))) narrow(b, of(a) / r);
        return;
      case Op::pow:
        if (b.is_constant() && constant_value(b) != 0) narrow(a, root(r, constant_value(b), of(a)));
        return;
      case Op::sqrt:
        return narrow(a, not_negative(power(not_negative(r), 2)));
      case Op::exp:
        return narrow(a, logarithm(r));
      case Op::log:
        return narrow(a, exponential(r));
      case Op::abs:
        return narrow(a, {-r.hi, r.hi});
      case Op::tanh:
        return narrow(a, increasing_between([](double v) { return std::atanh(v); }, -1, 1, r));
      case Op::sinh:
        return narrow(a, increasing([](double v) { return std::asinh(v); }, r));
      case Op::asinh:
        return narrow(a, increasing([](double v) { return std::sinh(v); }, r));
      case Op::cosh: {
        const double most = outward(0, r.hi < 1 ? infinite : std::acosh(r.hi)).hi;
        return narrow(a, {-most, most});
      }
      case Op::min:
        narrow_smaller(a, b, r);
        return narrow_smaller(b, a, r);
      case Op::max:
        narrow_larger(a, b, r);
        return narrow_larger(b, a, r);
      case Op::ifelse:
        return choose(a, b, e.operand(2), r);
      case Op::lt:
      case Op::le:
        if (is_true(r)) order(a, b);
        if (is_false(r)) order(b, a);
        return;
      default:
        return;
    }
  }

  static bool is_true(Interval condition) { return condition.lo > 0; }
  static bool is_false(Interval condition) { return condition.hi <= 0; }

  /// min(a, other) in r: both are at least r.lo, and one of them is at most r.hi.
  void narrow_smaller(Expr a, Expr other, Interval r) {
    narrow(a, {r.lo, of(other).lo > r.hi ? r.hi : infinite});
  }
  void narrow_larger(Expr a, Expr other, Interval r) {
    narrow(a, {of(other).hi < r.lo ? r.lo : -infinite, r.hi});
  }
  /// ifelse(condition, p, q) in r.
  void choose(Expr condition, Expr p, Expr q, Interval r) {
    if (are_apart(of(p), r)) narrow(condition, never);
    if (are_apart(of(q), r)) narrow(condition, always);
    if (is_true(of(condition))) narrow(p, r);
    if (is_false(of(condition))) narrow(q, r);
  }
  /// a ≤ b.
  void order(Expr a, Expr b) {
    narrow(a, {-infinite, of(b).hi});
    narrow(b, {of(a).lo, infinite});
  }

  std::vector<Expr> nodes_;
  std::vector<Interval> value_;
  std::unordered_map<Expr, std::size_t> place_;
  std::vector<std::size_t> zero_;
  bool empty_ = false, shrunk_ = false;
};

}  // namespace

bool has_no_solution(std::span<const Expr> rows, const std::unordered_map<Expr, double>& known) {
  constexpr int halvings = 3;
  return Propagation(rows, known).finds_empty(halvings);
}

}  // namespace pendula::dae
