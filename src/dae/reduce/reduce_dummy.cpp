// Form "dummy": index reduction with dummy derivatives.
//
// Equation i is kept with all its derivatives up to order c_i. That makes Σ c_i equations too many, so
// that as many derivatives x_j⁽ᵏ⁾ become algebraic variables. They are chosen such that the Jacobian of
// every group of differentiated equations with respect to them is regular (Mattsson & Söderlind, SIAM J.
// Sci. Comput. 14(3), 1993). Stage s takes the rows with c_i ≥ s of the system Jacobian and, among the
// columns of the stage before, as many independent ones; the derivatives of order d_j - s + 1 of their
// variables are dummies.
#include <algorithm>
#include <exception>
#include <functional>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/model_key.hpp"
#include "dae/rank/rank.hpp"
#include "dae/reduce/array_point.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/regularise/regularise.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;
using PointValues = std::unordered_map<Expr, double>;

/// The slopes at a point that gives the unknowns and possibly parameters; other parameters have their values
/// in the model.
std::vector<double> slopes_at(const DummyPivoting& pivoting, const Model& m, PointValues values) {
  for (Expr leaf : leaves(pivoting.slopes)) {
    if (symbol_of(leaf).kind == Kind::constant || values.count(leaf)) continue;
    const auto it = m.values.find(leaf);
    if (it == m.values.end())
      throw Error(text("form \"dummy\": the point gives no value for ", to_text(leaf),
                       "; pass a start: reduce(\"dummy\", { at = sys:init{ … } })"));
    values[leaf] = pendula::evaluate({&it->second, 1}, {})[0];
  }
  return pendula::evaluate(pivoting.slopes, values);
}

}  // namespace

DummySelection select_dummies(const ModelPtr& m, const PointValues& point) {
  const std::shared_ptr<const DummyPivoting> shared = shared_pivoting(m);
  const DummyPivoting& pivoting = *shared;
  if (!point.empty()) return pivoting.best(slopes_at(pivoting, *m, point));
  // If the slopes are undefined at the first point (sinh(10⁹ x) at x = 1), the next one is used.
  const std::function<PointValues()> points[] = {
      [&] { return pivoting.generic_point(false); }, [&] { return pivoting.generic_point(true); },
      [&] { return values_at_regular_point(*m, require_regular(*m).index); }};
  std::exception_ptr first;
  for (const auto& next : points) try {
      if (const PointValues there = next(); !there.empty())
        return pivoting.best(slopes_at(pivoting, *m, there));
    } catch (const Failure&) {
      if (!first) first = std::current_exception();
    }
  std::rethrow_exception(first);
}

DummySelection selection_of(const Model& dummy) {
  DummySelection selection;
  const ModelPtr source = dummy.parent;
  const Analysis a = require_regular(*source);
  std::unordered_map<Expr, int> orders;
  for (const Variable& v : dummy.variables) orders[v.leaf] = v.order;
  for (std::size_t j = 0; j < source->variables.size(); ++j) {
    const Expr x = source->variables[j].leaf;
    const auto it = orders.find(x);
    for (int k = (it == orders.end() ? 0 : it->second) + 1; k <= a.offsets.d[j]; ++k)
      selection.dummies.push_back(derivative_leaf(x, k));
  }
  return selection;
}

Expr original_leaf(const Model& dummy, Expr leaf) {
  for (const auto& [old, meaning] : dummy.relations)
    if (meaning == leaf) return old;
  return leaf;
}

// ── the model with a selection ──

namespace {

/// Every block with its derivatives. Rows of a block that are differentiated differently are often separated.
std::vector<Block> with_derivatives(const Model& m, const Offsets& o, std::vector<std::string>& trace,
                                    std::vector<Expr>& highest) {
  std::vector<Block> blocks = m.blocks;  // the equations keep their numbers; derivatives are appended
  std::size_t first = 0;
  for (std::size_t b = 0; b < m.blocks.size(); ++b) {
    const auto size = static_cast<std::size_t>(m.blocks[b].lhs.size());
    int most = 0;
    for (std::size_t r = 0; r < size; ++r) most = std::max(most, o.c[first + r]);
    std::vector<Expr> residual(m.residuals.begin() + static_cast<std::ptrdiff_t>(first),
                               m.residuals.begin() + static_cast<std::ptrdiff_t>(first + size));
    for (std::size_t r = 0; r < size; ++r)  // 0 = C reads better than 0 = -C
      if (m.blocks[b].lhs[r].is_zero()) residual[r] = m.blocks[b].rhs[r];
    for (int k = 1; k <= most; ++k) {
      std::vector<Expr> rows;
      std::vector<std::string> labels;
      for (std::size_t r = 0; r < size; ++r)
        if (k <= o.c[first + r]) {
          rows.push_back(residual[r] = simplify(total_derivative(residual[r])));
          labels.push_back(m.label(first + r));
        }
      const VecX right = column(rows);
      const bool all = size > 1 && rows.size() == size;
      const std::string note = text(all ? text("(", b + 1, ")") : join(labels, ", "), " differentiated",
                                    k == 1   ? ""
                                    : k == 2 ? " twice"
                                             : text(" ", k, " times"));
      trace.push_back(text("dummy: ", note, ":"));
      for (std::size_t i = 0; i < rows.size(); ++i)
        trace.push_back(text("     ", all ? labels[i] + ":  " : "", formula("0 = ", ref(rows[i]))));
      blocks.push_back({VecX::Zero(right.size()), right, note});
    }
    for (std::size_t r = 0; r < size; ++r)
      if (o.c[first + r] > 0) highest.push_back(residual[r]);
    first += size;
  }
  return blocks;
}

/// A new algebraic variable for every dummy: y′ -> y_dot, y″ -> y_ddot.
Substitution stand_ins(const Model& m, const DummySelection& selection, std::vector<Expr>& made) {
  auto used = used_names(m);
  Substitution s;
  for (Expr leaf : selection.dummies) {
    const Symbol& symbol = symbol_of(leaf);
    if (symbol.order == 0) continue;  // the variable itself has become algebraic
    std::string name = symbol.name + "_";
    for (int k = 1; k < std::min(symbol.order, 3); ++k) name += "d";
    name += symbol.order > 3 ? text("d", symbol.order, "ot") : "dot";
    name = fresh_name(used, name, name + "_");
    used.insert(name);
    s[leaf] = newly_declared_by_form(pendula::symbol(Kind::variable, name));
    made.push_back(s[leaf]);
  }
  return s;
}

/// Explains the choice: the differentiated equations can be solved for these derivatives.
void trace_choice(const std::vector<Expr>& rows, const Model& m, const Offsets& o,
                  const DummySelection& selection, std::vector<std::string>& trace) {
  constexpr std::size_t largest = 3;  // rows of a matrix that is shown
  constexpr int widest = 80;          // columns of a terminal
  std::vector<Expr> chosen;
  for (Expr leaf : selection.dummies)
    for (std::size_t j = 0; j < m.variables.size(); ++j)
      if (m.variables[j].leaf == symbol_of(leaf).base && symbol_of(leaf).order == o.d[j])
        chosen.push_back(leaf);
  if (chosen.empty() || chosen.size() != rows.size() || chosen.size() > largest) return;
  const MatX J = jacobian(rows, chosen).unaryExpr([](Expr e) { return simplify(e); });
  const Expr determinant = simplify(linalg::determinant(J));
  if (display_width(to_text(determinant)) > widest) return;
  const auto add = [&](const auto&... parts) {
    trace.push_back(shown_from(Detail::full, text("     ", parts...)));
  };
  const std::string where =
      exact_value(determinant) ? "" : text(" where ", formula(ref(determinant), " ≠ 0"));
  if (chosen.size() == 1)
    return add("The highest derivative is linear in ", names_of(chosen), " with the coefficient ",
               formula(ref(J(0, 0))), ": it can be solved for it", where, ".");
  add("The highest derivatives are linear in ", names_of(chosen), " with the Jacobian");
  add(formula("J = ", ref(J)));
  add(formula("det J = ", ref(determinant)));
  add("They can be solved for these unknowns", where, ".");
}

/// Of a regular source. Says nothing of the numbers that the selection was made with.
ModelPtr made_with(const ModelPtr& source, const DummySelection& selection) {
  const Analysis a = require_regular(*source);
  if (selection.dummies.empty()) refuse_form("dummy", *source, "no equation that has to be differentiated");
  ModelOptions options = child_of(source);
  options.form = "dummy";
  options.u = source->inputs;
  std::vector<Expr> highest;
  std::vector<Block> blocks = with_derivatives(*source, a.offsets, options.trace, highest);
  std::vector<Expr> made;
  const Substitution s = stand_ins(*source, selection, made);
  for (Block& b : blocks) {
    b.lhs = mapped(b.lhs, s);
    b.rhs = mapped(b.rhs, s);
  }
  move_invariants(options, s);
  for (const auto& [leaf, meaning] : s) options.relations[leaf] = meaning;
  std::vector<Expr> states;
  std::unordered_map<Expr, int> taken;
  for (Expr leaf : selection.dummies) ++taken[symbol_of(leaf).base];
  for (std::size_t j = 0; j < source->variables.size(); ++j) {
    const Expr x = source->variables[j].leaf;
    const int order = a.offsets.d[j] - (taken.count(x) ? taken.at(x) : 0);
    (order > 0 ? options.x : options.z).push_back(x);
    for (int k = 0; k < order; ++k) states.push_back(derivative_leaf(x, k));
  }
  options.z.insert(options.z.end(), made.begin(), made.end());
  options.trace.push_back(
      shown_from(Detail::full,
                 text("     Each equation is kept together with its derivatives: ", selection.dummies.size(),
                      " equations more than unknowns. As many derivatives become algebraic unknowns:")));
  options.trace.push_back(
      text("     ", names_of(selection.dummies), " are replaced by the dummy derivatives ", names_of(made)));
  trace_choice(highest, *source, a.offsets, selection, options.trace);
  options.trace.push_back(text("     States: ", names_of(states), "."));
  options.trace.push_back("     Every constraint is an equation, so nothing drifts; the index is 1.");
  return make_model(std::move(blocks), std::move(options));
}

}  // namespace

ModelPtr reduce_dummy(const ModelPtr& model, const DummySelection& selection) {
  using Key = std::pair<ModelPtr, std::vector<Expr>>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::size_t h = std::hash<ModelPtr>()(key.first);
      for (Expr leaf : key.second) h = 31 * h + leaf.id();
      return h;
    }
  };
  static LruCache<Key, ModelPtr, Hash> known(PerModel<ModelPtr>::capacity);
  const ModelPtr source = regular_form(original(model));
  const Key key{source, selection.dummies};
  if (const ModelPtr* found = known.find(key)) return *found;
  return known.insert(key, made_with(source, selection), PerModel<ModelPtr>::size_of(*source));
}

ModelPtr reduce_dummy(const ModelPtr& model, const ReduceOptions& options) {
  const DummySelection selection = select_dummies(regular_form(original(model)), options.at);
  auto copy = std::make_shared<Model>(*reduce_dummy(model, selection));
  const std::string quality =
      text("     Quality of the choice ", rounded(selection.quality, 3),
           " (1 for the best choice there is, 0 where J is singular); integrate() compares it with the best "
           "choice after every step and changes where that is twice as good (sol:switches()).");
  copy->trace.insert(copy->trace.end() - 1, shown_from(Detail::full, quality));
  if (!options.at.empty()) return copy;
  copy->trace.push_back(shown_from(Detail::full,
                                   "     The states were chosen at a generic point; reduce(\"dummy\", { at = "
                                   "sys:init{ … } }) chooses them at a start."));
  return copy;
}

}  // namespace pendula::dae
