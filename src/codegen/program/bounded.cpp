#include "codegen/program/bounded.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "base/limits/stack.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/node_map.hpp"

namespace pendula::codegen {
namespace {

constexpr std::size_t most_factors = 200;

bool is_product(Expr e) {
  return e.op() == Op::mul || e.op() == Op::div || e.op() == Op::neg ||
         (e.op() == Op::pow && e.operand(1).is_constant());
}
bool is_sum(Op op) { return op == Op::add || op == Op::sub || op == Op::neg; }
bool overflows(Op op) { return op == Op::exp || op == Op::sinh || op == Op::cosh; }

/// The size of a number; 1 for a parameter, whose value is unknown here.
std::optional<double> size_of(Expr e) {
  if (e.is_constant()) return std::fabs(constant_value(e));
  const bool named =
      e.is_symbol() && (symbol_of(e).kind == Kind::parameter || symbol_of(e).kind == Kind::constant);
  return named ? std::optional(1.0) : std::nullopt;
}

/// The same function, or sinh(u) and cosh(u) with exp(u), which overflow together.
bool is_same_growth(Expr a, Expr b) {
  return a == b || (a.op() != Op::exp && overflows(a.op()) && overflows(b.op()) && b.op() != Op::exp &&
                    a.operand(0) == b.operand(0));
}

/// Is b = exp(-u) for a = exp(u), bounded or not? It is 0 where a is infinite.
bool is_mirrored(Expr a, Expr b) {
  const Expr bare = a.op() == Op::ifelse ? a.operand(2) : a;
  return bare.op() == Op::exp && b.op() == Op::exp && bare.operand(0) == -b.operand(0);
}

/// A product as its factors and their exponents, all of them positive.
struct Factors {
  struct Power {
    Expr base;
    double exponent;
  };
  std::vector<Power> dividend, divisor;

  explicit Factors(Expr product) {
    std::vector<Power> open{{product, 1}};
    while (!open.empty() && dividend.size() + divisor.size() < most_factors) {
      const auto [e, n] = open.back();
      open.pop_back();
      if (!is_product(e)) {
        (n > 0 ? dividend : divisor).push_back({e, std::fabs(n)});
      } else if (e.op() == Op::pow) {
        open.push_back({e.operand(0), n * constant_value(e.operand(1))});
      } else {
        open.push_back({e.operand(0), n});
        if (e.op() != Op::neg) open.push_back({e.operand(1), e.op() == Op::mul ? n : -n});
      }
    }
    if (!open.empty()) dividend.clear();  // too many factors to analyse
  }
};

/// A function exp(u), sinh(u) or cosh(u) to be bounded. The bound is the power of ten at which the divisor
/// overflows or, if the quotient has a nonzero limit, at which both are far from overflow.
struct Growth {
  Expr function;
  double dividend, divisor;  ///< its powers in both
  double decades() const {
    return std::floor(308 / std::max(divisor, 2 * (dividend == divisor ? dividend : 1)));
  }
  double bound() const { return std::pow(10.0, decades()); }
  /// Limit for added numbers and their reciprocals: the bound is 10¹⁷ times as large as their quotient.
  double largest_number() const { return std::pow(10.0, std::floor((decades() - 17) / 2)); }
};

/// Is an expression this function, or a sum of multiples of it and of terms that stay finite?
class GrowsLike {
 public:
  explicit GrowsLike(const Growth& growth) : growth_(growth), largest_(growth.largest_number()) {}
  bool operator()(Expr e) {
    found_ = false;
    return sums(e) && found_;
  }
  double power_in(const std::vector<Factors::Power>& factors) {
    double power = 0;
    for (const auto& [base, exponent] : factors)
      if ((*this)(base)) power += exponent;
    return power;
  }

 private:
  bool sums(Expr e) {
    check_stack();
    if (!is_sum(e.op())) return is_term(e, 1);
    const auto parts = e.operands();
    return sums(parts[0]) && (e.op() == Op::neg || sums(parts[1]));
  }
  bool is_term(Expr e, double scale) {
    check_stack();
    if (const auto size = size_of(e)) return *size * scale <= largest_;
    if (e.op() == Op::mul) {
      if (const auto size = size_of(e.operand(0))) return is_term(e.operand(1), scale * *size);
      if (const auto size = size_of(e.operand(1))) return is_term(e.operand(0), scale * *size);
    } else if (e.op() == Op::div) {
      if (const auto size = size_of(e.operand(1))) return is_term(e.operand(0), scale / *size);
    }
    if (is_mirrored(e, growth_.function)) return true;
    const bool same = is_same_growth(e, growth_.function);
    found_ = found_ || same;
    return same && scale <= largest_ && scale >= 1 / largest_;
  }
  Growth growth_;
  double largest_;
  bool found_ = false;
};

/// The function that makes the product ∞/∞, if its limit is known: fᵖ/(r + c f)ᵖ tends to c⁻ᵖ, or to 0.
std::optional<Growth> overflowing(const Factors& factors) {
  constexpr double largest_power = 8;
  const auto with_powers = [&](const Growth& growth) {
    GrowsLike grows(growth);
    return Growth{growth.function, grows.power_in(factors.dividend), grows.power_in(factors.divisor)};
  };
  const auto judged = [&](Expr function) -> std::optional<Growth> {
    const Growth growth = with_powers({function, 1, 1}), checked = with_powers(growth);
    const bool known =
        growth.dividend >= 1 && growth.divisor >= growth.dividend && growth.divisor <= largest_power;
    const bool same = checked.dividend == growth.dividend && checked.divisor == growth.divisor;
    return known && same ? std::optional(growth) : std::nullopt;
  };
  for (const auto& factor : factors.dividend)
    for (Expr node : topological({&factor.base, 1})) {
      if (!overflows(node.op())) continue;
      if (const auto growth = judged(node)) return growth;
    }
  return std::nullopt;
}

/// A product in which all factors with this growth are bounded.
class Bounded {
 public:
  explicit Bounded(const Growth& growth) : growth_(growth) {}

  Expr product(Expr e) const {
    check_stack();
    if (!is_product(e)) return GrowsLike(growth_)(e) ? sum(e) : e;
    const Expr a = e.operand(0);
    if (e.op() == Op::neg) return -product(a);
    const Expr b = e.operand(1);
    return make(e.op(), product(a), e.op() == Op::pow ? b : product(b));
  }

 private:
  Expr sum(Expr e) const {
    check_stack();
    if (e.op() == Op::neg) return -sum(e.operand(0));
    if (!is_sum(e.op()) && e.op() != Op::mul && e.op() != Op::div) return held(e);
    const Expr a = e.operand(0), b = e.operand(1);
    return make(e.op(), sum(a), sum(b));
  }
  Expr held(Expr e) const {
    if (!is_same_growth(e, growth_.function)) return e;
    const Expr most = growth_.bound();
    const Expr below = ifelse(lt(most, e), most, e);  // NaN is preserved
    return e.op() == Op::sinh ? ifelse(lt(e, -most), -most, below) : below;
  }
  Growth growth_;
};

/// Products that are not factors of other products.
std::vector<Expr> whole_products(const std::vector<Expr>& order, std::span<const Expr> outputs) {
  static NodeMap<char> whole;
  whole.clear();
  for (Expr output : outputs) whole[output] = 1;
  for (Expr node : order)
    if (!is_product(node))
      for (Expr operand : node.operands()) whole[operand] = 1;
  std::vector<Expr> products;
  std::copy_if(order.begin(), order.end(), std::back_inserter(products),
               [](Expr node) { return is_product(node) && whole[node] != 0; });
  return products;
}

}  // namespace

std::vector<Expr> bounded_quotients(std::span<const Expr> outputs) {
  std::vector<Expr> result(outputs.begin(), outputs.end());
  constexpr int deepest = 4;  // bounded products nested in exponents of others
  for (int depth = 0; depth < deepest; ++depth) {
    const std::vector<Expr> order = topological(result);
    if (std::none_of(order.begin(), order.end(), [](Expr node) { return overflows(node.op()); })) break;
    Substitution bounded;
    for (Expr product : whole_products(order, result))
      if (const auto growth = overflowing(Factors(product)))
        bounded[product] = Bounded(*growth).product(product);
    if (bounded.empty()) break;
    result = substitute(result, bounded);
  }
  return result;
}

}  // namespace pendula::codegen
