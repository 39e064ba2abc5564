#include "dae/singular/domain_conditions.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/lru_cache.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "dae/model/truncated_text.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

/// Factors at least one of which vanishes with the denominator. Long denominators are returned unfactored,
/// since factorisation would take too long.
std::vector<Expr> factors_of(Expr denominator) {
  constexpr std::size_t long_expression = 60, most = 20000;  // nodes; cached denominators
  static LruCache<Expr, std::vector<Expr>, std::hash<Expr>, Refers::by_touch> known(most);
  if (const auto* factors = known.find(denominator)) {
    for (Expr factor : *factors) touch(factor);
    return *factors;
  }
  const bool is_long = topological(std::vector{denominator}).size() > long_expression;
  return known.insert(denominator, is_long ? std::vector{denominator} : vanishing_factors(denominator));
}

class Collector {
 public:
  void add(Expr term) {
    const Expr a = term.operand(0);
    switch (term.op()) {
      case Op::div:
        return add_poles(term.operand(1), term);
      case Op::tan:
        return add_poles(cos(a), term);
      case Op::atanh:
      case Op::asin:
      case Op::acos:
        return add_one(1 - a * a, term, false);
      case Op::acosh:
        return add_one(a - 1, term, false);
      case Op::log:
      case Op::sqrt:
        return add_one(a, term, false);
      case Op::pow:
        return add_power(term);
      default:
        return;
    }
  }
  std::vector<DomainCondition> list;

 private:
  void add_power(Expr term) {
    const Expr base = term.operand(0), exponent = term.operand(1);
    const mpq_class* q = exact_value(exponent);
    if (q && *q < 0) return add_poles(base, term);
    if (!q || q->get_den() != 1) add_one(base, term, false);
  }
  void add_poles(Expr denominator, Expr term) {
    if (denominator.is_constant() || !varies(denominator)) return;
    for (Expr factor : factors_of(denominator)) {
      if (factor.is_symbol() || factor.op() != Op::ifelse) {
        add_one(factor, term, sign_of(factor) == 0);
        continue;
      }
      for (int branch : {1, 2}) add_poles(factor.operand(branch), term);  // one of them vanishes with it
    }
  }
  void add_one(Expr factor, Expr term, bool pole) {
    if (factor.is_constant() || !varies(factor) || !seen_.insert(factor).second) return;
    list.push_back({factor, term, pole});
  }
  std::unordered_set<Expr> seen_;
};

/// The signs that stand for branches held fixed (internal symbols), each with the value 1.
Substitution signs_in(const std::vector<Expr>& expressions) {
  Substitution one;
  for (Expr leaf : leaves(expressions))
    if (leaf.is_symbol() && symbol_of(leaf).kind == Kind::slot) one[leaf] = 1;
  return one;
}

}  // namespace

std::string DomainCondition::reason() const {
  const bool has_value = term.op() == Op::sqrt || term.op() == Op::asin || term.op() == Op::acos ||
                         (term.op() == Op::pow && sign_of(term.operand(1)) > 0);
  const bool is_root = has_value && term.op() != Op::asin && term.op() != Op::acos;
  const bool of_amount = factor.op() == Op::abs;
  // a branch that is held fixed is |x| = σ x with a sign σ that users have not written
  const Substitution signs = signs_in({factor, term});
  const std::string name = signs.empty() ? truncated_text(term, 60)
                           : pole        ? "what is divided by it"
                           : is_root     ? "its root"
                                         : "a function of it";
  return text(truncated_text(simplify(substitute(factor, signs))), " = 0 there, and ", name,
              has_value ? " has no derivative" : " is not defined",
              is_root && of_amount
                  ? " (for sign(u)*sqrt(abs(u)) write u/(u^2 + s^2)^(1/4), s small: it has one)"
              : is_root ? " (where the solution stays at 0, write max(…, 0) under the root)"
                        : "");
}

std::vector<DomainCondition> domain_conditions(const std::vector<Expr>& equations) {
  Collector collector;
  for (Expr node : topological(equations))
    if (!node.is_constant() && !node.is_symbol()) collector.add(node);
  return std::move(collector.list);
}

}  // namespace pendula::dae
