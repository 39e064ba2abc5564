// Does an expression contain one of a set of leaves?
#pragma once

#include <algorithm>
#include <unordered_set>

#include "expr/graph/graph.hpp"

namespace pendula {

inline bool depends_on_any(Expr e, const std::unordered_set<Expr>& set) {
  const auto inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) { return set.count(leaf) > 0; });
}

}  // namespace pendula
