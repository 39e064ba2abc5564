#include "expr/rewrite/tidied.hpp"

#include <unordered_map>

#include "expr/rewrite/rewrite.hpp"

namespace pendula {

bool is_short(Expr e, double nodes) {
  std::unordered_map<Expr, double> size;
  for (Expr node : topological({&e, 1})) {
    double sum = 1;
    for (Expr operand : node.operands()) sum += size[operand];
    size[node] = sum;
  }
  return size[e] <= nodes;
}

Expr tidied(Expr e) { return is_short(e) ? simplify(e) : e; }

}  // namespace pendula
