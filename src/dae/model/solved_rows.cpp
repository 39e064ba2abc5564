#include "dae/model/solved_rows.hpp"

#include <algorithm>
#include <unordered_set>

#include "dae/model/occurrence.hpp"
#include "expr/graph/switched_by.hpp"

namespace pendula::dae {

static bool is_unknown(Expr leaf) { return symbol_of(leaf).kind == Kind::variable; }

bool is_explicit_ode(const Model& m) {
  std::unordered_set<Expr> top;
  for (const Variable& v : m.variables) {
    if (v.order == 0) return false;
    top.insert(derivative_leaf(v.leaf, v.order));
  }
  std::unordered_set<Expr> left;
  std::vector<Expr> right;
  for (const Block& b : m.blocks)
    for (Eigen::Index row = 0; row < b.lhs.size(); ++row) {
      if (!top.count(b.lhs[row]) || !left.insert(b.lhs[row]).second) return false;
      right.push_back(b.rhs[row]);
    }
  if (left.size() != top.size()) return false;
  const auto inside = leaves(right);
  return std::none_of(inside.begin(), inside.end(), [&](Expr leaf) { return top.count(leaf) > 0; });
}

std::vector<Solved> solved_rows(const Model& m) {
  if (is_explicit_ode(m)) {
    std::vector<Solved> rows;
    for (std::size_t i = 0; i < m.residuals.size(); ++i) {
      const auto [block, row] = m.origin[i];
      rows.push_back({i, m.blocks[block].lhs[row], m.blocks[block].rhs[row]});
    }
    return rows;
  }
  std::unordered_set<Expr> top_set, taken, unknown;
  for (Expr leaf : m.top_derivatives()) top_set.insert(leaf);
  std::vector<Solved> rows;
  Occurrence tops(m.residuals, top_set);
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    const Expr r = m.residuals[i];
    const auto top = tops.only(r);
    if (!top || taken.count(*top)) continue;
    auto line = tops.line(r);
    if (!line) line = {partial(r, *top), Expr(0)};
    bool constant = !line->slope.is_zero();
    for (Expr leaf : leaves({&line->slope, 1})) constant = constant && !is_unknown(leaf);
    if (!constant || is_switched_by(r, {*top})) continue;
    taken.insert(*top);
    if (!tops.line(r)) line->rest = substitute(r, {{*top, Expr(0)}});
    rows.push_back({i, *top, -line->rest / line->slope, line->slope});
  }
  return rows;
}

}  // namespace pendula::dae
