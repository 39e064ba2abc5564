#include "expr/graph/power_product.hpp"

#include <algorithm>

#include "base/limits/stack.hpp"

namespace pendula {
namespace {

/// base^exponent, a factor of a product.
struct Factor {
  Expr base;
  mpq_class exponent;
};

bool is_fraction(const Factor& f) { return f.exponent.get_den() != 1; }

/// A power of a root as one power: (√a)³ as a^(3/2), but √(a²) unchanged.
Factor factor_of(Expr e) {
  check_stack();
  mpq_class outer(1, 2);
  if (e.op() == Op::pow) {
    const mpq_class* n = exact_value(e.operand(1));
    if (!n) return {e, 1};
    outer = *n;
  } else if (e.op() != Op::sqrt) {
    return {e, 1};
  }
  Factor inner = factor_of(e.operand(0));
  if (!is_fraction(inner)) return {e.operand(0), outer};
  inner.exponent *= outer;
  return inner;
}

/// The factors of a product from left to right; of a very long product the rest is one factor.
std::vector<Factor> factors_of(Expr e) {
  constexpr std::size_t most = 100;  // a choice: making a product must not cost the square of its length
  struct Open {
    Expr e;
    bool inverse;
  };
  std::vector<Factor> found;
  std::vector<Open> open{{e, false}};
  while (!open.empty()) {
    const auto [part, inverse] = open.back();
    open.pop_back();
    const bool quotient = part.op() == Op::div, divisible = found.size() + open.size() < most;
    if (divisible && part.op() == Op::neg) {
      found.push_back({-1, 1});
      open.push_back({part.operand(0), inverse});
    } else if (divisible && (quotient || part.op() == Op::mul)) {
      open.push_back({part.operand(1), inverse != quotient});
      open.push_back({part.operand(0), inverse});
    } else {
      found.push_back(factor_of(part));
      if (inverse) found.back().exponent = -found.back().exponent;
    }
  }
  return found;
}

bool cancel(const Factor& a, const Factor& b) {
  return a.base == b.base && !a.base.is_constant() && (is_fraction(a) || is_fraction(b)) &&
         sgn(a.exponent) * sgn(b.exponent) < 0;
}

Expr product(const std::vector<Factor>& factors) {
  Expr result = 1;
  for (const Factor& f : factors) {
    const Expr power = pow(f.base, Expr(mpq_class(abs(f.exponent))));
    result = sgn(f.exponent) < 0 ? result / power : result * power;
  }
  return result;
}

/// x·y with exponents added where they cancel, or nothing.
std::optional<Expr> cancelled(const std::vector<Factor>& x, std::vector<Factor> y) {
  std::vector<Factor> all;
  bool any = false;
  for (Factor f : x) {
    const auto partner = std::find_if(y.begin(), y.end(), [&](const Factor& g) { return cancel(f, g); });
    if (partner != y.end()) {
      f.exponent += partner->exponent;
      y.erase(partner);
      any = true;
    }
    all.push_back(f);
  }
  if (!any) return std::nullopt;
  all.insert(all.end(), y.begin(), y.end());
  return product(all);
}

/// Σ terms·y where one of the terms cancels with y.
std::optional<Expr> term_by_term(Expr sum, Expr y, int depth) {
  constexpr int deepest = 20;  // a choice: terms that are looked at whenever a sum is multiplied
  const bool difference = sum.op() == Op::sub;
  if ((sum.op() != Op::add && !difference) || depth > deepest) return std::nullopt;
  const Expr a = sum.operand(0), b = sum.operand(1);
  const auto part = [&](Expr term) {
    const auto found = cancelled(factors_of(term), factors_of(y));
    return found ? found : term_by_term(term, y, depth + 1);
  };
  const auto first = part(a), second = part(b);
  if (!first && !second) return std::nullopt;
  const Expr left = first ? *first : a * y, right = second ? *second : b * y;
  return difference ? left - right : left + right;
}

}  // namespace

bool is_root(Expr e) {
  if (e.op() != Op::sqrt && e.op() != Op::pow) return false;
  const Factor f = factor_of(e);
  return is_fraction(f) && !f.base.is_constant();
}

Expr cancelled_product(Expr x, Expr y) {
  if (const auto found = cancelled(factors_of(x), factors_of(y))) return *found;
  if (const auto found = term_by_term(x, y, 0)) return *found;
  if (const auto found = term_by_term(y, x, 0)) return *found;
  return x * y;
}

}  // namespace pendula
