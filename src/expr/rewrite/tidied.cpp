#include "expr/rewrite/tidied.hpp"

#include <span>
#include <vector>

#include "expr/rewrite/rewrite.hpp"

namespace pendula {

bool is_short(Expr e, double nodes) {
  std::vector<Expr> open{e};
  for (double seen = 1; !open.empty(); ++seen) {  // counts nodes of the tree, up to the deciding number
    const std::span<const Expr> operands = open.back().operands();
    open.pop_back();
    if (seen + static_cast<double>(open.size() + operands.size()) > nodes) return false;
    open.insert(open.end(), operands.begin(), operands.end());
  }
  return true;
}

Expr tidied(Expr e) { return is_short(e) ? simplify(e) : e; }

}  // namespace pendula
