#include "dae/points/repeated_factors.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "expr/polynomial/rational_form.hpp"

namespace pendula::dae {

/// e², e³, …, or a product whose factors share a symbol: a repeated factor leaves one, multiplied out or not.
static bool may_repeat(Expr e) {
  if (e.is_constant() || e.is_symbol()) return false;
  if (e.op() == Op::pow) {
    const mpq_class* q = exact_value(e.operand(1));
    return q && q->get_den() == 1 && *q > 1;
  }
  if (e.op() != Op::mul) return false;
  const Expr left = e.operand(0), right = e.operand(1);
  const auto inside = leaves({&left, 1}), others = leaves({&right, 1});
  return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
    return std::find(others.begin(), others.end(), leaf) != others.end();
  });
}

std::optional<RepeatedFactors> repeated_factors(Expr e, const std::unordered_set<Expr>& bases) {
  constexpr std::size_t longest = 100, most_leaves = 12;
  const auto nodes = topological({&e, 1});
  if (nodes.size() > longest || std::none_of(nodes.begin(), nodes.end(), may_repeat)) return {};
  if (leaves({&e, 1}).size() > most_leaves) return {};
  const auto has_unknown = [&](Expr factor) {
    const auto inside = leaves({&factor, 1});
    return std::any_of(inside.begin(), inside.end(),
                       [&](Expr leaf) { return bases.contains(symbol_of(leaf).base); });
  };
  try {
    RepeatedFactors found{1, true};
    bool repeated = false;
    for (const auto& [factor, power] : numerator_factors(e)) {
      found.square_free = found.square_free * factor;
      if (!has_unknown(factor)) continue;
      repeated = repeated || power > 1;
      found.all = found.all && power > 1;
    }
    return repeated ? std::optional(found) : std::nullopt;
  } catch (const UserFacing&) {  // no polynomial with exact coefficients
    return {};
  }
}

bool is_power(Expr e, const std::unordered_set<Expr>& bases) {
  const auto factors = repeated_factors(e, bases);
  return factors && factors->all;
}

}  // namespace pendula::dae
