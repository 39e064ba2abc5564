// Does a branch of an expression depend on some leaves? sign, < and ≤ have the derivative 0 and yet change,
// so that slopes alone do not show whether an expression is linear in a leaf: x + sign(x).
#pragma once

#include "expr/graph/depends_on.hpp"

namespace pendula {

/// Does e contain a sign, < or ≤ of one of these leaves? Cost: one pass over e, and one for each of these.
inline bool is_switched_by(Expr e, const std::unordered_set<Expr>& set) {
  const std::vector<Expr> nodes = topological({&e, 1});
  return std::any_of(nodes.begin(), nodes.end(), [&](Expr node) {
    const bool switches = node.op() == Op::sign || node.op() == Op::lt || node.op() == Op::le;
    return switches && depends_on_any(node, set);
  });
}

}  // namespace pendula
