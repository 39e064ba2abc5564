#include "dae/model/first_order.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/occurrence.hpp"
#include "dae/model/solved_rows.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {

/// Sets x′ = f, 0 = g if every derivative has a solved row of its own.
static void fill_explicit_form(const Model& m, FirstOrder& fo) {
  std::unordered_map<Expr, Expr> f;
  std::unordered_set<std::size_t> used;
  for (const Solved& row : solved_rows(m)) {
    f[row.derivative] = row.f;
    used.insert(row.residual);
  }
  if (f.size() != m.top_derivatives().size()) return;
  const auto list = m.top_derivatives();
  std::vector<Expr> all = m.residuals;
  for (const auto& [derivative, right] : f) all.push_back(right);
  Occurrence tops(all, std::unordered_set<Expr>(list.begin(), list.end()));
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    if (used.count(i)) continue;
    if (tops.any(m.residuals[i])) return;
    fo.g.push_back(m.residuals[i]);
  }
  for (const auto& [derivative, right] : f)
    if (tops.any(right)) return;
  for (std::size_t i = 0; i < fo.x.size(); ++i) {
    const auto it = f.find(fo.xdot[i]);
    fo.f.push_back(it == f.end() ? derivative_leaf(fo.x[i]) : it->second);
  }
  fo.semi_explicit = true;
}

FirstOrder first_order(const Model& m) {
  if (m.residuals.size() != m.variables.size())
    throw Error(text("the model has ", counted(m.residuals.size(), "equation"), " for ",
                     counted(m.variables.size(), "unknown"), "; sys:structure() shows what is wrong"));
  FirstOrder fo;
  fo.x = m.states();
  fo.z = m.algebraic();
  fo.p = m.parameters;
  const std::unordered_set<Expr> state_set(fo.x.begin(), fo.x.end());
  for (Expr x : fo.x) {
    const Expr next = derivative_leaf(x);
    if (!state_set.count(next)) {
      fo.xdot.push_back(next);
      continue;
    }
    const Symbol& s = symbol_of(x);
    fo.xdot.push_back(symbol(Kind::slot, text("K_", s.name, "_", s.order)));
    fo.F.push_back(fo.xdot.back() - next);
    fo.label.push_back(to_text(next) + " is the derivative of " + to_text(x));
    fo.sides.emplace_back();
  }
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    const auto [block, row] = m.origin[i];
    fo.F.push_back(m.residuals[i]);
    fo.label.push_back("equation " + m.label(i));
    fo.sides.emplace_back(std::in_place, m.blocks[block].lhs[row], m.blocks[block].rhs[row]);
  }
  for (Expr leaf : leaves(m.residuals))
    if (std::find(m.inputs.begin(), m.inputs.end(), symbol_of(leaf).base) != m.inputs.end())
      fo.u.push_back(leaf);
  fill_explicit_form(m, fo);
  return fo;
}

std::shared_ptr<const FirstOrder> shared_first_order(const ModelPtr& model) {
  static PerModel<std::shared_ptr<const FirstOrder>> known;
  return known.of(model, [&] { return std::make_shared<const FirstOrder>(first_order(*model)); });
}

}  // namespace pendula::dae
