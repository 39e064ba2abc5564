#include "expr/rewrite/scaled_exponentials.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "base/limits/stack.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula {
namespace {

bool overflows(Op op) { return op == Op::exp || op == Op::sinh || op == Op::cosh; }

/// Operations through which v eˢ is carried.
bool carries(Expr e) {
  switch (e.op()) {
    case Op::add:
    case Op::sub:
    case Op::neg:
    case Op::mul:
    case Op::div:
      return true;
    case Op::pow:
      return e.operand(1).is_constant();
    default:
      return false;
  }
}

/// What is known of an expression from the operations that carry.
struct Growth {
  bool grows = false;     ///< an exponential is in it
  bool divides = false;   ///< one is in a divisor
  bool quotient = false;  ///< ∞/∞ may be in it
  bool vanishes = false;  ///< it is 0 where all exponentials in it are
  bool lowers = false;    ///< a divisor that vanishes is in it: 0/0 may be, too

  void join(const Growth& other) {
    grows = grows || other.grows;
    divides = divides || other.divides;
    quotient = quotient || other.quotient;
    lowers = lowers || other.lowers;
  }
};

/// The exponent s as a sum of multiples of expressions.
class Shift {
 public:
  Shift() = default;
  explicit Shift(Expr one) : terms_{{one, 1}} {}

  bool empty() const { return terms_.empty(); }
  void add(const Shift& other, double factor) {
    for (const auto& [e, n] : other.terms_) {
      const auto same =
          std::find_if(terms_.begin(), terms_.end(), [e = e](const auto& t) { return t.first == e; });
      if (same == terms_.end())
        terms_.emplace_back(e, factor * n);
      else
        same->second += factor * n;
    }
    std::erase_if(terms_, [](const auto& t) { return t.second == 0; });
  }
  /// Whether every factor has this sign.
  bool has_sign(int sign) const {
    return std::all_of(terms_.begin(), terms_.end(), [&](const auto& t) { return t.second * sign > 0; });
  }
  Expr sum() const {
    Expr result(0);
    for (const auto& [e, n] : terms_) result += n == 1 ? e : n == -1 ? -e : Expr(n) * e;
    return result;
  }

 private:
  std::vector<std::pair<Expr, double>> terms_;
};

/// v eˢ.
struct Scaled {
  Expr v;
  Shift s;
  Expr product() const { return s.empty() ? v : v * exp(s.sum()); }
};

/// Scales one expression after the other.
class Scaling {
 public:
  explicit Scaling(std::span<const Expr> outputs) {
    const std::vector<Expr> order = topological(outputs);
    if (std::none_of(order.begin(), order.end(), [](Expr e) { return overflows(e.op()); })) return;
    for (Expr e : order) growth_.emplace(e, growth_of(e));
    const std::unordered_set<Expr> whole = whole_expressions(order, outputs);
    for (Expr e : order) {
      const Growth& growth = growth_.at(e);
      if (e.op() == Op::log && growth_.at(e.operand(0)).grows) {
        const Scaled inside = scaled(e.operand(0), true);
        replacements_[e] = inside.s.empty() ? log(inside.v) : inside.s.sum() + log(inside.v);
      } else if (growth.quotient && whole.count(e) && carries(e)) {
        replacements_[e] = scaled(e, growth.lowers).product();
      }
    }
  }

  const Substitution& replacements() const { return replacements_; }

 private:
  Growth growth_of(Expr e) const {
    if (overflows(e.op())) return {.grows = true, .vanishes = e.op() == Op::exp};
    Growth result;
    if (!carries(e)) return result;
    const Growth& a = growth_.at(e.operand(0));
    result.join(a);
    if (e.op() == Op::neg) {
      result.vanishes = a.vanishes;
      return result;
    }
    if (e.op() == Op::pow) {
      const bool divides = constant_value(e.operand(1)) < 0;
      result.divides = result.divides || (a.grows && divides);
      result.lowers = result.lowers || (a.vanishes && divides);
      result.vanishes = a.vanishes && !divides;
      return result;
    }
    const Growth& b = growth_.at(e.operand(1));
    result.join(b);
    if (e.op() == Op::div) {
      result.divides = result.divides || b.grows;
      result.quotient = result.quotient || (a.grows && b.grows);
      result.lowers = result.lowers || b.vanishes;
      result.vanishes = a.vanishes && !b.vanishes;
    } else if (e.op() == Op::mul) {
      result.quotient = result.quotient || (a.divides && b.grows) || (b.divides && a.grows);
      result.vanishes = a.vanishes || b.vanishes;
    } else {
      result.vanishes = a.vanishes && b.vanishes;
    }
    return result;
  }

  /// Outputs and what other operations than those that carry take as operands.
  static std::unordered_set<Expr> whole_expressions(const std::vector<Expr>& order,
                                                    std::span<const Expr> outputs) {
    std::unordered_set<Expr> whole(outputs.begin(), outputs.end());
    for (Expr e : order)
      if (!carries(e))
        for (Expr operand : e.operands()) whole.insert(operand);
    return whole;
  }

  Expr replaced(Expr e) const { return replacements_.empty() ? e : substitute(e, replacements_); }

  /// both_ways: exponents below -40, too, lest all terms of a sum vanish: of a divisor, or in a logarithm.
  Scaled scaled(Expr e, bool both_ways) {
    check_stack();
    auto& known = made_[both_ways];
    if (const auto at = known.find(e); at != known.end()) return at->second;
    Scaled result;
    if (overflows(e.op()))
      result = leaf(e, both_ways);
    else if (!growth_.at(e).grows)
      result = {replaced(e), {}};
    else
      result = operation(e, both_ways);
    known.emplace(e, result);
    return result;
  }

  Scaled leaf(Expr e, bool both_ways) const {
    constexpr int ordinary = 40;  // e⁴⁰ > 10¹⁷, and its powers up to 17 are finite
    const Expr u = replaced(e.operand(0)), most(ordinary);
    const auto held = [&](Expr of) { return ifelse(lt(most, of), most, of); };  // NaN is preserved
    if (e.op() == Op::exp) {
      const Expr bounded = both_ways ? -held(-held(u)) : held(u);
      return {exp(bounded), Shift(u - bounded)};
    }
    const Expr size = abs(u), bounded = held(size);
    return {e.op() == Op::cosh ? cosh(bounded) : sinh(ifelse(lt(u, 0), -bounded, bounded)),
            Shift(size - bounded)};
  }

  Scaled operation(Expr e, bool both_ways) {
    const Scaled a = scaled(e.operand(0), both_ways);
    if (e.op() == Op::neg) return {-a.v, a.s};
    if (e.op() == Op::pow) {
      Scaled power{make(Op::pow, a.v, e.operand(1)), {}};
      power.s.add(a.s, constant_value(e.operand(1)));
      return power;
    }
    const Scaled b = scaled(e.operand(1), both_ways);
    if (e.op() == Op::add || e.op() == Op::sub) return sum(e.op(), a, b, both_ways);
    Scaled product{make(e.op(), a.v, b.v), a.s};
    product.s.add(b.s, e.op() == Op::mul ? 1 : -1);
    return product;
  }

  static Scaled sum(Op op, const Scaled& a, const Scaled& b, bool both_ways) {
    Shift apart = b.s;
    apart.add(a.s, -1);
    if (apart.empty()) return {make(op, a.v, b.v), a.s};
    // each term of s is ≥ 0 unless exponents are scaled both ways
    if (!both_ways && apart.has_sign(1)) return {make(op, a.v * exp(-apart.sum()), b.v), b.s};
    if (!both_ways && apart.has_sign(-1)) return {make(op, a.v, b.v * exp(apart.sum())), a.s};
    const Expr more = max(apart.sum(), 0);
    Scaled result{make(op, a.v * exp(-more), b.v * exp(min(apart.sum(), 0))), a.s};
    result.s.add(Shift(more), 1);
    return result;
  }

  std::unordered_map<Expr, Growth> growth_;
  std::unordered_map<Expr, Scaled> made_[2];
  Substitution replacements_;
};

}  // namespace

std::vector<Expr> with_scaled_exponentials(std::span<const Expr> outputs) {
  const Scaling scaling(outputs);
  if (scaling.replacements().empty()) return {outputs.begin(), outputs.end()};
  return substitute(outputs, scaling.replacements());
}

}  // namespace pendula
