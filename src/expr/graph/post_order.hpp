// Depth-first traversal of the graph without recursion: expressions are deeper than the stack of a thread.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula {

/// Appends the nodes below `root` and root itself to `order`, operands before their operation.
/// enter(e): shall e be visited? True at most once for every node.
template <class Enter>
void append_post_order(Expr root, Enter enter, std::vector<Expr>& order) {
  if (!enter(root)) return;
  // a node, and the number of its operands already visited
  std::vector<std::pair<Expr, std::uint32_t>> stack{{root, 0}};
  while (!stack.empty()) {
    auto& [e, entered] = stack.back();
    const auto operands = e.operands();
    if (entered == operands.size()) {
      order.push_back(e);
      stack.pop_back();
      continue;
    }
    const Expr operand = operands[entered++];
    if (enter(operand)) stack.push_back({operand, 0});
  }
}

}  // namespace pendula
