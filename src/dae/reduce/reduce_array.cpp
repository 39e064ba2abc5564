// Form "array": rows of the derivative array that determine the solution near a point, as a system
// of index 1.
#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <unordered_set>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/points/generic_functions.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/reduce/array_point.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/structure/differentiation.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;
using Columns = std::vector<Index>;

Mat columns_of(const Mat& J, const Columns& list) { return J(Eigen::all, list); }

Columns range(Index from, Index to) {
  Columns list;
  for (Index j = from; j < to; ++j) list.push_back(j);
  return list;
}

/// The first `count` pivots of a QR factorisation: independent columns.
Columns pivots(const Mat& m, Index count) {
  if (count == 0) return {};  // Eigen cannot factorise an empty matrix
  const Eigen::ColPivHouseholderQR<Mat> qr(m);
  Columns list;
  for (Index k = 0; k < count; ++k) list.push_back(qr.colsPermutation().indices()[k]);
  return list;
}

/// Independent columns of ∂F_k/∂(higher derivatives), low orders first. The open derivatives are then of
/// highest order, in which the rows are linear. Other choices lead to quadratic equations, which may have
/// no real root.
Columns higher_of_low_order(const ArrayPoint& a) {
  std::map<int, Columns> by_order;
  for (Index j = a.states() + a.first(); j < a.J.cols(); ++j)
    by_order[symbol_of(a.equations->columns[j]).order].push_back(j);
  Columns chosen, seen;
  for (const auto& [order, columns] : by_order) {
    seen.insert(seen.end(), columns.begin(), columns.end());
    const auto more = rank_with_gap(columns_of(a.J, seen)).rank - static_cast<Index>(chosen.size());
    if (more <= 0) continue;
    Mat rest = columns_of(a.J, columns);
    if (!chosen.empty()) {
      const Eigen::HouseholderQR<Mat> qr(columns_of(a.J, chosen));
      rest = (full_q(qr.householderQ()).transpose() * rest)
                 .bottomRows(rest.rows() - static_cast<Index>(chosen.size()))
                 .eval();
    }
    for (Index j : pivots(rest, more)) chosen.push_back(columns[j]);
  }
  return chosen;
}

/// The chosen rows, the x and the higher derivatives that they determine; the other x are states.
struct ArraySelection {
  Columns rows, dependent, higher;
};

/// Chooses a square regular system in (dependent x, x′, higher): as many higher derivatives as are
/// independent, and as many x as F_k = 0 has conditions on them. Variables without derivative in F and rows
/// with few derivatives are preferred.
ArraySelection select(const ArrayPoint& a, const Model& m) {
  constexpr double prefer = 1e2;
  ArraySelection s;
  s.higher = higher_of_low_order(a);
  Columns y = range(a.states(), a.states() + a.first());
  y.insert(y.end(), s.higher.begin(), s.higher.end());
  const Mat Y = columns_of(a.J, y);
  const Eigen::HouseholderQR<Mat> qr(Y);
  const Mat left = full_q(qr.householderQ()).rightCols(a.J.rows() - Y.cols());  // left null space
  Mat conditions = left.transpose() * a.J.leftCols(a.states());
  const int count = rank_with_gap(a.J).rank - static_cast<int>(y.size());
  // at a singular point, conditions that are independent nearby become dependent
  if (count < 0 || count > a.states())
    throw Failure(
        "the form \"array\": the rows of the derivative array have no clear rank at this point; choose another one, "
        "reduce(\"array\", { at = sys:init{ … } })");
  for (Index j = 0; j < a.states(); ++j)
    if (m.variables[j].order == 0) conditions.col(j) *= prefer;
  s.dependent = pivots(conditions, count);
  Columns unknowns = s.dependent;
  unknowns.insert(unknowns.end(), y.begin(), y.end());
  Mat S = columns_of(a.J, unknowns).transpose();
  const auto equations = static_cast<Index>(a.array().equations());
  for (Index i = 0; i < S.cols(); ++i) S.col(i) /= std::pow(prefer, static_cast<double>(i / equations));
  s.rows = pivots(S, S.rows());
  std::sort(s.rows.begin(), s.rows.end());
  return s;
}

/// Drops higher derivatives that occur in a single row, together with that row, which only defines them.
void prune(ArraySelection& s, const ArrayPoint& a) {
  for (bool again = true; again;) {
    again = false;
    for (std::size_t k = 0; k < s.higher.size() && !again; ++k) {
      const Expr leaf = a.equations->columns[s.higher[k]];
      Columns users;
      for (Index i : s.rows) {
        const Expr row = a.array().rows()[i];
        if (depends_on(row, leaf)) users.push_back(i);
      }
      if (users.size() != 1) continue;
      std::erase(s.rows, users[0]);
      s.higher.erase(s.higher.begin() + static_cast<std::ptrdiff_t>(k));
      again = true;
    }
  }
}

/// Constants for the higher derivatives that the rows contain but do not determine. Any value is valid, so 0.
/// If the rows are nonlinear in the higher derivatives, 0 may admit no start, or be too far from one; then
/// the values at the given point are used.
Substitution constants_for_open(const ArrayPoint& a, const ArraySelection& s, bool given) {
  std::vector<Expr> rows, higher;
  for (Index i : s.rows) rows.push_back(a.array().rows()[i]);
  const std::vector<Expr> inside = leaves(rows);
  const std::unordered_set<Expr> used(inside.begin(), inside.end());
  const std::set<Index> chosen(s.higher.begin(), s.higher.end());
  Substitution zeros, values;
  for (Index j = a.states() + a.first(); j < a.J.cols(); ++j) {
    const Expr leaf = a.equations->columns[j];
    if (!used.count(leaf)) continue;
    higher.push_back(leaf);
    if (chosen.count(j)) continue;
    zeros[leaf] = Expr(0);
    values[leaf] = Expr(a.w[j]);
  }
  if (zeros.empty() || !given) return zeros;
  std::vector<Expr> slopes;
  for (const Entry& e : sparse_jacobian(rows, higher)) slopes.push_back(e.value);
  const std::vector<Expr> in_slopes = leaves(slopes);
  const std::unordered_set<Expr> of_slopes(in_slopes.begin(), in_slopes.end());
  const bool linear =
      std::none_of(higher.begin(), higher.end(), [&](Expr leaf) { return of_slopes.count(leaf) > 0; });
  return linear ? zeros : values;
}

/// Replacements of derivatives that become algebraic variables by x_dot, x_ddot …, printed x′, x″, and of
/// undetermined ones by constants.
struct Replacement {
  Substitution by;
  std::vector<Expr> made;
  std::vector<Expr> slopes;  ///< x′ of states that become x_dot as well; x′ = x_dot joins the equations
};

/// The x′ of states to be replaced by unknowns: all except those that occur only in a row x′ = f. Otherwise z
/// would follow from the x′ of the method, whose errors are the tolerance divided by the step.
std::vector<Expr> slopes_of_states(const ArrayPoint& a, const ArraySelection& s, const Model& m) {
  std::unordered_map<Expr, std::size_t> solved_in;
  for (const Solved& row : solved_rows(m)) solved_in[row.derivative] = row.residual;
  std::unordered_map<Expr, std::vector<Index>> users;
  for (Index i : s.rows)
    for (Expr leaf : leaves({&a.array().rows()[i], 1})) users[leaf].push_back(i);
  std::vector<Expr> list;
  for (Index j = 0; j < a.states(); ++j) {
    const Expr slope = derivative_leaf(a.equations->columns[j]);
    const auto own = solved_in.find(slope);
    const auto& rows = users[slope];
    const bool dependent = std::find(s.dependent.begin(), s.dependent.end(), j) != s.dependent.end();
    if (dependent || rows.empty()) continue;
    const bool stays =
        rows.size() == 1 && own != solved_in.end() && rows[0] == static_cast<Index>(own->second);
    if (!stays) list.push_back(slope);
  }
  return list;
}

Replacement replacement(const ArrayPoint& a, const ArraySelection& s, const Model& m,
                        const Substitution& constants) {
  Replacement r;
  auto used = used_names(m);
  const auto introduce = [&](Expr leaf, bool printed_as_derivative = true) {
    const Symbol& symbol = symbol_of(leaf);
    std::string dots = "dot";
    for (int k = 1; k < std::min(symbol.order, 4); ++k) dots.insert(0, "d");
    if (symbol.order > 4) dots = text("d", symbol.order, "ot");
    const std::string name = fresh_name(used, symbol.name + "_" + dots, symbol.name + "_" + dots + "_");
    used.insert(name);
    const Expr made = pendula::symbol(Kind::variable, name);
    r.by[leaf] = printed_as_derivative ? declared_for(leaf, made) : newly_declared_by_form(made);
    r.made.push_back(r.by[leaf]);
  };
  for (Index j : s.dependent) introduce(derivative_leaf(a.equations->columns[j]));
  for (Index j : s.higher) introduce(a.equations->columns[j]);
  r.slopes = slopes_of_states(a, s, m);
  for (Expr slope : r.slopes) introduce(slope, false);
  r.by.insert(constants.begin(), constants.end());
  return r;
}

/// "once", "twice", "3 times".
std::string times(int k) { return k == 1 ? "once" : k == 2 ? "twice" : text(k, " times"); }

void trace_selection(ModelOptions& options, const Model& m, const ArrayPoint& a, const ArraySelection& s,
                     const Replacement& r, int index) {
  const int n = static_cast<int>(a.array().equations());
  options.trace.push_back(text("array: the index is ", index, ": the ", n,
                               " equations and their derivatives up to order ", index,
                               " determine the derivatives of all unknowns."));
  options.trace.push_back(
      shown_from(Detail::full,
                 "     Of these rows as many are kept as determine them (rank of the derivative "
                 "array at a point of the solution):"));
  std::map<int, std::vector<std::string>> by_order;
  for (Index i : s.rows)
    by_order[static_cast<int>(i) / n].push_back(m.label(static_cast<std::size_t>(i) % a.array().equations()));
  for (const auto& [k, rows] : by_order)
    options.trace.push_back(text("     ", k == 0 ? "as they were written" : "differentiated " + times(k),
                                 ": ", join(rows, ", ")));
  options.trace.push_back(shown_from(
      Detail::full,
      text("     Derivatives that the rows contain besides those of the states become algebraic unknowns: ",
           grouped_names(r.made))));
  if (!options.x.empty()) options.trace.push_back("     States: " + grouped_names(options.x));
  options.trace.push_back("     The index is 1, every constraint is an equation, nothing drifts.");
  options.trace.push_back(shown_from(
      Detail::full,
      "     The rows were chosen at a point of the solution; reduce(\"array\", { at = sys:init{ … } }) "
      "chooses the rows that suit a start."));
}

ModelPtr made_of(const ModelPtr& source, const ArrayPoint& a, const ArraySelection& s, int index,
                 const Substitution& constants) {
  const Model& m = *source;
  const Replacement r = replacement(a, s, m, constants);
  ModelOptions options = child_of(source);
  options.form = "array";
  options.mechanics.reset();
  std::vector<Block> blocks;
  for (Index i : s.rows) {
    const auto row = static_cast<std::size_t>(i) % a.array().equations();
    const int k = static_cast<int>(static_cast<std::size_t>(i) / a.array().equations());
    const std::string label = constraint_label(m, row, k);
    const auto [block, within] = m.origin[row];
    if (k == 0)
      blocks.push_back({VecX::Constant(1, substitute(m.blocks[block].lhs[within], r.by)),
                        VecX::Constant(1, substitute(m.blocks[block].rhs[within], r.by)), label});
    else
      blocks.push_back({VecX::Constant(1, Expr(0)),
                        VecX::Constant(1, tidied(substitute(a.array().rows()[i], r.by))), label});
  }
  for (Expr slope : r.slopes)
    blocks.push_back({VecX::Constant(1, slope), VecX::Constant(1, r.by.at(slope)), ""});
  move_invariants(options, r.by);
  for (const auto& [leaf, meaning] : r.by)
    if (!meaning.is_constant()) options.relations[leaf] = meaning;
  options.u = m.inputs;
  std::vector<Expr> dependent;
  for (Index j : s.dependent) dependent.push_back(a.equations->columns[j]);
  for (const Variable& v : m.variables)
    (std::find(dependent.begin(), dependent.end(), v.leaf) == dependent.end() ? options.x : options.z)
        .push_back(v.leaf);
  options.z.insert(options.z.end(), r.made.begin(), r.made.end());
  trace_selection(options, m, a, s, r, index);
  return make_model(std::move(blocks), std::move(options));
}

/// The model of a selection; remembered where it contains no number of the point.
ModelPtr form_of(const ModelPtr& source, const ArrayPoint& a, ArraySelection s, int index, bool given) {
  using Key = std::pair<ModelPtr, Columns>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      return std::hash<ModelPtr>()(key.first) ^ 31 * WordsHash()(key.second);
    }
  };
  static LruCache<Key, ModelPtr, Hash> known(PerModel<ModelPtr>::capacity);
  Key key{source, {given}};
  for (const Columns* list : {&s.rows, &s.dependent, &s.higher}) {
    key.second.push_back(static_cast<Index>(list->size()));
    key.second.insert(key.second.end(), list->begin(), list->end());
  }
  if (const ModelPtr* found = known.find(key)) return *found;
  prune(s, a);
  const Substitution constants = constants_for_open(a, s, given);
  const ModelPtr made = made_of(source, a, s, index, constants);
  const bool has_numbers = std::any_of(constants.begin(), constants.end(),
                                       [](const auto& entry) { return !entry.second.is_zero(); });
  return has_numbers ? made : known.insert(key, made, PerModel<ModelPtr>::size_of(*made));
}

}  // namespace

ModelPtr reduce_array(const ModelPtr& model, const ReduceOptions& options) {
  const ModelPtr source = to_first_order(original(model));
  if (source->residuals.size() != source->variables.size() || !source->invariants.empty())
    throw Failure("form \"array\": the model is not square");
  if (without_calls(source->residuals) != source->residuals)
    throw Failure("form \"array\": the model contains unspecified functions; give them as expressions");
  const int index = differentiation_index(*source).index;
  auto near = options.at;
  for (const auto& [leaf, value] : options.at)  // x′ is v_x in a model of second order
    if (const Expr own = resolve(*source, leaf); own.is_symbol()) near.emplace(own, value);
  static PerModel<ArrayEquationsPtr> known;
  const ArrayEquationsPtr equations =
      known.of(source, [&] { return std::make_shared<const ArrayEquations>(*source, index); });
  if (!equations->numeric)
    throw Failure(text("form \"array\" takes dense ranks of the equations and their derivatives up to order ",
                       index, ", here of ", equations->columns.size(),
                       " unknowns and derivatives; it is for at most ", ArrayEquations::most_columns,
                       ". Take another form, as reduce \"ggl\" or \"acc\""));
  const auto at = regular_point(*source, equations, near);
  if (!at)
    throw Failure(
        text("form \"array\": no point was found at which the equations and their derivatives up to order ",
             index, " determine the derivatives of all unknowns",
             options.at.empty() ? "; reduce(\"array\", { at = sys:init{ … } }) looks at a start" : ""));
  return form_of(source, *at, select(*at, *source), index, !options.at.empty());
}

}  // namespace pendula::dae
