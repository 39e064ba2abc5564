// Does an expression contain one of a set of leaves, or any leaf that varies?
#pragma once

#include <algorithm>
#include <unordered_set>

#include "expr/graph/graph.hpp"

namespace pendula {

inline bool depends_on_any(Expr e, const std::unordered_set<Expr>& set) {
  const auto inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) { return set.count(leaf) > 0; });
}

/// Neither a parameter nor a named constant: a variable, a derivative, an input, the time.
inline bool is_varying(Expr leaf) {
  const Kind kind = symbol_of(leaf).kind;
  return kind != Kind::parameter && kind != Kind::constant;
}

inline bool varies(Expr e) {
  const auto inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(), is_varying);
}

}  // namespace pendula
