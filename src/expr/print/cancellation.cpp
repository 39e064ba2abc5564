#include "expr/print/cancellation.hpp"

#include <algorithm>
#include <cmath>

#include <gmpxx.h>

#include "base/epsilon.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula {
namespace {

using Real = mpf_class;
// Squaring back costs 52 bits for |x| = 10⁴, two each time; a sum of which 200 bits cancel (see below) has 68
// left, more than a double.
constexpr mp_bitcnt_t bits = 320;
constexpr double largest_argument = 1e4;  // of exp, sin and cos; beyond, results are infinite or unknown

struct Pair {
  Real cos, sin;
};

/// So many that |x|/2ⁿ < 2⁻¹¹: the remainder of Taylor's series after 39 terms is then 2⁻⁴⁴⁰/40! < 2⁻⁵⁹⁰.
int halvings(const Real& x) { return std::max(0, 12 + std::ilogb(least_size + std::fabs(x.get_d()))); }
constexpr unsigned long taylor_terms = 40;

Real halved(const Real& x, int times) {
  Real r(x, bits);
  mpf_div_2exp(r.get_mpf_t(), r.get_mpf_t(), static_cast<mp_bitcnt_t>(times));
  return r;
}

/// Taylor's series of a small argument, squared back.
Real exponential(const Real& x) {
  const int n = halvings(x);
  const Real r = halved(x, n);
  Real sum(1, bits), term(1, bits);
  for (unsigned long k = 1; k < taylor_terms; ++k) sum += term = Real(term * r, bits) / k;
  for (int k = 0; k < n; ++k) sum *= sum;
  return sum;
}

Pair cosine_and_sine(const Real& x) {
  const int n = halvings(x);
  const Real r = halved(x, n);
  Pair p{Real(1, bits), Real(0, bits)};
  Real term(1, bits);
  for (unsigned long k = 1; k < taylor_terms; ++k) {
    term = Real(term * r, bits) / k;
    Real& to = k % 2 == 0 ? p.cos : p.sin;
    if (k / 2 % 2 == 0)
      to += term;
    else
      to -= term;
  }
  for (int k = 0; k < n; ++k) p = {Real(p.cos * p.cos - p.sin * p.sin, bits), Real(2 * p.sin * p.cos, bits)};
  return p;
}

/// Newton's method for e^y = x.
Real logarithm(const Real& x) {
  Real y(std::log(x.get_d()), bits);
  constexpr int steps = 4;  // 52 digits of the double, then 104, 208, 416: three suffice
  for (int k = 0; k < steps; ++k) y += Real(x * exponential(Real(-y, bits)), bits) - 1;
  return y;
}

class Values {
 public:
  explicit Values(const std::unordered_map<Expr, double>& leaves) : leaves_(leaves) {}

  /// False if it cannot be decided.
  bool add(Expr node) {
    std::optional<Real> value = node.operands().empty() ? leaf(node) : operation(node);
    if (!value) return false;
    values_.emplace(node, std::move(*value));
    return true;
  }
  const Real& operator()(Expr node) const { return values_.at(node); }

 private:
  std::optional<Real> leaf(Expr node) const {
    if (const auto given = leaves_.find(node); given != leaves_.end()) return real(given->second);
    if (const mpq_class* exact = exact_value(node)) return Real(*exact, bits);
    return node.is_constant() ? real(evaluate({&node, 1}, {})[0]) : std::nullopt;
  }
  static std::optional<Real> real(double v) {
    return std::isfinite(v) ? std::optional(Real(v, bits)) : std::nullopt;
  }

  std::optional<Real> operation(Expr node) const {
    const Real& a = values_.at(node.operand(0));
    const bool moderate = abs(a) < largest_argument;
    switch (node.op()) {
      case Op::neg:
        return Real(-a, bits);
      case Op::sqrt:
        return a < 0 ? std::nullopt : std::optional(Real(sqrt(a), bits));
      case Op::exp:
        return moderate ? std::optional(exponential(a)) : std::nullopt;
      case Op::cos:
        return moderate ? std::optional(cosine_and_sine(a).cos) : std::nullopt;
      case Op::sin:
        return moderate ? std::optional(cosine_and_sine(a).sin) : std::nullopt;
      case Op::cosh:
      case Op::sinh:
        return moderate ? std::optional(hyperbolic(a, node.op())) : std::nullopt;
      case Op::log:
        return logarithm_of(a);
      case Op::add:
      case Op::sub:
      case Op::mul:
      case Op::div:
      case Op::pow:
        return of_two(node.op(), a, values_.at(node.operand(1)));
      default:
        return {};
    }
  }

  static Real hyperbolic(const Real& a, Op op) {
    const Real up = exponential(a), down(1 / up, bits);
    return Real((op == Op::cosh ? Real(up + down, bits) : Real(up - down, bits)) / 2, bits);
  }
  static std::optional<Real> logarithm_of(const Real& a) {
    const double size = a.get_d();
    return size > least_size && size < 1 / least_size ? std::optional(logarithm(a)) : std::nullopt;
  }

  static std::optional<Real> of_two(Op op, const Real& a, const Real& b) {
    if (op == Op::add) return Real(a + b, bits);
    if (op == Op::sub) return Real(a - b, bits);
    if (op == Op::mul) return Real(a * b, bits);
    if (op == Op::div) return b == 0 ? std::nullopt : std::optional(Real(a / b, bits));
    constexpr int most = 1000;  // factors: a choice
    if (b == floor(b) && abs(b) <= most) {
      Real power(1, bits);
      for (long k = std::labs(b.get_si()); k > 0; --k) power *= a;
      if (b >= 0) return power;
      return power == 0 ? std::nullopt : std::optional(Real(1 / power, bits));
    }
    const auto log = logarithm_of(a);
    if (!log) return {};
    const Real exponent(b * *log, bits);
    return abs(exponent) < largest_argument ? std::optional(exponential(exponent)) : std::nullopt;
  }

  const std::unordered_map<Expr, double>& leaves_;
  std::unordered_map<Expr, Real> values_;
};

}  // namespace

std::optional<double> value_without_cancellation(Expr e,
                                                 const std::unordered_map<Expr, double>& leaf_values) {
  constexpr std::size_t most = 2000;  // nodes: some milliseconds
  const std::vector<Expr> nodes = topological({&e, 1});
  if (nodes.size() > most) return {};
  for (const Expr node : nodes)
    if (node.op() == Op::call || node.op() == Op::solve) return {};
  const std::vector<double> doubles = evaluate(nodes, leaf_values);
  std::unordered_map<Expr, double> size;
  for (std::size_t k = 0; k < nodes.size(); ++k) size[nodes[k]] = std::fabs(doubles[k]);
  constexpr double two_digits = 1e-2;  // more than that of 16 are missed by a reader of ten
  const auto loses = [&](Expr node) {
    if (node.op() == Op::log) return size[node] < two_digits;  // of 1 + a small number
    if (node.op() != Op::add && node.op() != Op::sub) return false;
    return size[node] < two_digits * std::max(size[node.operand(0)], size[node.operand(1)]);
  };
  if (std::none_of(nodes.begin(), nodes.end(), loses)) return {};
  Values values(leaf_values);
  for (const Expr node : nodes)
    if (!values.add(node)) return {};
  const Real& value = values(e);
  if (e.op() == Op::add || e.op() == Op::sub) {
    const Real terms(abs(values(e.operand(0))) + abs(values(e.operand(1))), bits);
    Real rounding(terms, bits);
    mpf_div_2exp(rounding.get_mpf_t(), rounding.get_mpf_t(), 200);
    if (abs(value) <= rounding) return 0.0;
  }
  const double near = value.get_d();  // towards zero
  return near + Real(value - near, bits).get_d();
}

}  // namespace pendula
