#include "integrate/problem/rhs_layout.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "dae/structure/blocks.hpp"

namespace pendula::integrate {

/// Marks unknowns that may have several solutions for given values of those solved before. The equations are
/// solved in blocks, and a block can have several solutions if its matrix depends on its own unknowns.
/// (Positions may be ambiguous; velocities and accelerations at given positions are not.)
static std::vector<double> ambiguous(const std::vector<Expr>& unknowns,
                                     const std::vector<Position>& positions,
                                     const std::vector<Expr>& partials) {
  const int size = static_cast<int>(unknowns.size());
  dae::Pattern pattern(unknowns.size());
  for (const Position& p : positions) pattern[p.row].push_back(p.column);
  const dae::Blocks blocks = dae::dulmage_mendelsohn(pattern, size);
  std::vector<std::size_t> block_of_row(unknowns.size()), block_of_column(unknowns.size());
  // equations outside square blocks count as one block
  for (std::size_t b = 0; b < blocks.square.size(); ++b) {
    for (int row : blocks.square[b].rows) block_of_row[row] = b + 1;
    for (int column : blocks.square[b].columns) block_of_column[column] = b + 1;
  }
  std::vector<std::vector<Expr>> inside(blocks.square.size() + 1);
  for (std::size_t k = 0; k < positions.size(); ++k)
    if (const std::size_t b = block_of_row[positions[k].row]; b == block_of_column[positions[k].column])
      inside[b].push_back(partials[k]);
  std::unordered_map<Expr, int> column_of;
  for (int j = 0; j < size; ++j) column_of.emplace(unknowns[j], j);
  std::vector<double> result(unknowns.size(), 0.0);
  for (std::size_t b = 0; b < inside.size(); ++b)
    for (Expr leaf : leaves(inside[b]))
      if (const auto found = column_of.find(leaf);
          found != column_of.end() && block_of_column[found->second] == b)
        result[found->second] = 1;
  return result;
}

RhsLayout rhs_layout(const Problem& problem) {
  const dae::FirstOrder& model = problem.model();
  std::unordered_set<Expr> unknown(model.xdot.begin(), model.xdot.end());
  unknown.insert(model.z.begin(), model.z.end());
  const std::unordered_set<Expr> fixed(model.p.begin(), model.p.end());
  RhsLayout layout;
  std::vector<Expr> partials;
  for (std::size_t k = 0; k < problem.pattern().size(); ++k) {
    const Problem::Entry e = problem.pattern()[k];
    if (e.column < problem.n()) continue;
    layout.positions.push_back({e.row, e.column - problem.n()});
    partials.push_back(problem.partials()[k]);
  }
  std::unordered_set<Expr> inside;
  for (Expr leaf : leaves(partials)) {
    inside.insert(leaf);
    layout.linear = layout.linear && !unknown.count(leaf);
    layout.constant = layout.constant && (fixed.count(leaf) || symbol_of(leaf).kind == Kind::constant);
  }
  for (Expr e : layout.linear ? std::vector<Expr>{} : partials) {
    const std::vector<Expr> in_entry = leaves({&e, 1});
    layout.entry_is_nonlinear.push_back(
        std::any_of(in_entry.begin(), in_entry.end(), [&](Expr leaf) { return unknown.count(leaf) > 0; }));
  }
  std::vector<Expr> unknowns = model.xdot;
  unknowns.insert(unknowns.end(), model.z.begin(), model.z.end());
  for (Expr leaf : unknowns) layout.unknown_is_nonlinear.push_back(inside.count(leaf) ? 1 : 0);
  if (!layout.linear) layout.ambiguous = ambiguous(unknowns, layout.positions, partials);
  layout.values = codegen::Kernel(partials, problem.arguments());
  return layout;
}

}  // namespace pendula::integrate
