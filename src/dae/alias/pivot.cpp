#include "dae/alias/pivot.hpp"

#include <cmath>
#include <unordered_map>
#include <vector>

#include "base/limits/stack.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/depends_on.hpp"

namespace pendula::dae {

static bool is_nonzero_product(const Model& model, Expr c) {
  check_stack();
  if (c.is_constant()) return constant_value(c) != 0;
  if (c.is_symbol()) {
    if (symbol_of(c).kind == Kind::constant) return true;
    const auto value = model.values.find(c);
    if (symbol_of(c).kind != Kind::parameter || value == model.values.end()) return false;
    return value->second.is_constant() && constant_value(value->second) != 0;
  }
  const auto nonzero = [&](int i) { return is_nonzero_product(model, c.operand(i)); };
  switch (c.op()) {
    case Op::neg:
    case Op::sqrt:
      return nonzero(0);
    case Op::mul:
    case Op::div:
      return nonzero(0) && nonzero(1);
    case Op::pow:
      return nonzero(0) && c.operand(1).is_constant();
    default:
      return false;
  }
}

/// Is c a sum of parameters that is clearly nonzero at their values, not a residue of cancelled terms?
static bool is_nonzero_sum(const Model& model, Expr c) {
  constexpr double cancelled = 1e-3;  // of the terms: what loses three digits may be 0 at other parameters
  if ((c.op() != Op::add && c.op() != Op::sub) || varies(c)) return false;
  std::unordered_map<Expr, double> values;
  for (Expr leaf : leaves({&c, 1})) {
    const auto value = model.values.find(leaf);
    if (symbol_of(leaf).kind == Kind::constant) continue;
    if (value == model.values.end() || !value->second.is_constant()) return false;
    values[leaf] = constant_value(value->second);
  }
  const Expr all[] = {c, c.operand(0), c.operand(1)};
  const std::vector<double> v = evaluate(all, values);
  return std::fabs(v[0]) > cancelled * (std::fabs(v[1]) + std::fabs(v[2]));
}

std::optional<int> pivot_class(const Model& model, Expr c) {
  if (c.is_one() || c == Expr(-1)) return 0;
  if (c.is_constant()) return constant_value(c) != 0 ? std::optional(1) : std::nullopt;
  if (is_nonzero_product(model, c)) return 2;
  return is_nonzero_sum(model, c) ? std::optional(3) : std::nullopt;
}

}  // namespace pendula::dae
