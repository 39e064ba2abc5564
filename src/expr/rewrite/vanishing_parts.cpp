#include "expr/rewrite/vanishing_parts.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pendula {

Substitution vanishing_parts(std::span<const Expr> expressions,
                             const std::unordered_map<Expr, Expr>& values) {
  std::unordered_map<Expr, double> here, moved;
  for (const auto& [p, value] : values) {
    const double v = evaluate({&value, 1}, {})[0];
    here[p] = v;
    constexpr double last_places = 4e-16;  // the next double but one: 1.8 ε
    moved[p] = exact_value(value) ? v : v * (1 + last_places);
  }
  std::unordered_map<Expr, char> known;
  std::vector<Expr> parts;
  for (Expr e : topological(expressions)) {
    bool all =
        e.is_constant() || values.count(e) > 0 || (e.is_symbol() && symbol_of(e).kind == Kind::constant);
    if (!all && !e.is_symbol() && e.op() != Op::call) {
      const auto operands = e.operands();
      all = std::all_of(operands.begin(), operands.end(), [&](Expr x) { return known[x]; });
      if (all) parts.push_back(e);
    }
    known[e] = all;
  }
  const auto at = evaluate(parts, here), near = evaluate(parts, moved);
  Substitution zero;
  for (std::size_t k = 0; k < parts.size(); ++k)
    // rounding inside of the part, beside that of its parameters: a factor of ten is a choice
    if (std::fabs(at[k]) <= 10 * std::fabs(at[k] - near[k])) zero[parts[k]] = Expr(0);
  return zero;
}

}  // namespace pendula
