#include "dae/start/start.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/start/start_system.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

/// Do the equations hold at `next` to within rounding errors, or at least as well as at w? Residuals far
/// below their units count as well, since a unit may be far too large.
bool holds_as_well(const StartSystem& s, const Vec& w, const Vec& next) {
  const auto rows = static_cast<Index>(s.request.nearest ? s.first_fix : s.rows.size());
  const Vec r = s.residual(next).head(rows).cwiseAbs(), before = s.residual(w).head(rows).cwiseAbs();
  const Vec errors = s.rounding_errors(next).head(rows);
  return r.allFinite() && (r.array() <= before.array().max(allowed_errors * errors.array())).all();
}

/// Unknowns at a double root are known to √ε = 1.5e-8 of their unit, times a condition number.
constexpr double root_of_rounding = 1e-6;
/// relative to value and unit: a fixed value that the solution moved by less was not moved
constexpr double same_number = 1e-12;

/// Sets fixed values to exactly the given numbers, and other values to zero if the equations hold with zero
/// to within rounding: minimal steps leave 1e-16.
void clean(const StartSystem& s, Vec& w, bool slow) {
  constexpr double rounding = 1e-14;  // 45 ε
  std::vector<char> given(static_cast<std::size_t>(w.size()), 0);
  const auto try_values = [&](const Vec& next) {
    if (next == w) return true;
    const bool good = holds_as_well(s, w, next);
    if (good) w = next;
    return good;
  };
  Vec fixed = w;
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (const auto j = s.fixed_unknown(k))
      if (const double value = s.request.fix[k].second;
          !s.request.nearest || std::fabs(value - w[*j]) <= same_number * (s.unit[*j] + std::fabs(value)))
        fixed[*j] = value, given[*j] = 1;
  const double largest = w.size() ? w.cwiseQuotient(s.unit).cwiseAbs().maxCoeff() : 0;
  const auto small = [&](Index j) {
    return w[j] != 0 && !given[j] &&
           std::fabs(w[j]) < (slow ? root_of_rounding : 10 * rounding) * (1 + largest) * s.unit[j];
  };
  Vec zeros = fixed;
  for (Index j = 0; j < w.size(); ++j)
    if (small(j)) zeros[j] = 0;
  if (try_values(zeros) || w.size() > dense_up_to) return;
  try_values(fixed);
  for (Index j = 0; j < w.size(); ++j) {
    if (!small(j)) continue;
    Vec next = w;
    next[j] = 0;
    try_values(next);
  }
}

/// The same at a double root, where zero is accepted if the equations can be solved for the other unknowns: y
/// = 10⁻⁹ would halve the digits of all unknowns that depend on y.
void clean_double_root(const StartSystem& s, Vec& w) {
  if (w.size() > dense_up_to) return;
  const double largest = w.cwiseQuotient(s.unit).cwiseAbs().maxCoeff();
  const std::vector<char> fixed = s.fixed();
  for (Index j = 0; j < w.size(); ++j) {
    if (w[j] == 0 || fixed[j] || !(std::fabs(w[j]) < root_of_rounding * (1 + largest) * s.unit[j])) continue;
    Selection zero{{}, std::vector<char>(static_cast<std::size_t>(w.size()), 0)};
    zero.held[j] = 1;
    Vec next = w;
    next[j] = 0;
    const StartSolution other = gauss_newton(s, next, zero);
    if (other.solved && !other.slow && holds_as_well(s, w, other.w)) {
      w = other.w;
      clean(s, w, true);
    }
  }
}

void fill_ledger(ConsistentState& at, const StartSystem& s, const Freedom& open) {
  std::unordered_map<Expr, Origin> origin;
  for (std::size_t k = 0; k < s.fixes(); ++k)
    origin[resolve(s.model, s.request.fix[k].first)] = open.redundant[k] ? Origin::redundant : Origin::fixed;
  for (const Moved& m : at.moved) origin[resolve(s.model, m.leaf)] = Origin::moved;
  for (std::size_t j = 0; j < s.unknowns.size(); ++j) {
    const auto it = origin.find(s.unknowns[j]);
    const Origin from = it != origin.end() ? it->second : open.chosen[j] ? Origin::chosen : Origin::computed;
    at.rows.push_back({s.unknowns[j], at.values.at(s.unknowns[j]), from});
  }
  at.free = open.dimension;
  at.free_is_bound = open.is_bound;
}

void fill_constraints(ConsistentState& at, const StartSystem& s, const Vec& w) {
  const auto& invariants = s.low->invariants;
  if (invariants.empty()) return;
  std::vector<double> values;
  if (s.request.keep_invariants) {
    values = s.values(w);  // the invariants are the first rows
  } else {
    for (const Constraint& c : invariants) {
      const Expr residual = substitute(c.residual, s.request.inputs);
      values.push_back(pendula::evaluate({&residual, 1}, at.values)[0]);
    }
  }
  for (std::size_t i = 0; i < invariants.size(); ++i) at.constraints.emplace_back(invariants[i], values[i]);
}

std::vector<Moved> moved_values(const StartSystem& s, const Vec& w) {
  std::vector<Moved> list;
  const auto point = s.point(w);
  for (const auto& [leaf, from] : s.request.fix) {
    const Expr own = resolve(s.model, leaf);
    const double to = pendula::evaluate({&own, 1}, point)[0];
    const auto j = s.position(own);
    const double size = std::fabs(from) + (j ? s.unit[*j] : 1);
    if (std::fabs(to - from) > same_number * size) list.push_back({leaf, from, to});
  }
  return list;
}

/// The sparse form from which a large explicit form was made, since x′ = f(t, x) with linear solves in f has
/// a dense Jacobian. Empty if the model itself is as good.
ModelPtr sparse_relative(const ModelPtr& model) {
  if (model->form != "ode" && model->form != "project") return nullptr;
  if (static_cast<Index>(model->states().size()) < dense_up_to) return nullptr;
  ModelPtr m = model;
  while (m && m->form != "acc") m = m->parent;
  return m && m->states() == model->states() ? m : nullptr;
}

ConsistentStatePtr init_by(const ModelPtr& relative, const ModelPtr& model, const StartRequest& request) {
  auto at = std::make_shared<ConsistentState>(*init(relative, request));
  at->model = model;
  std::unordered_set<Expr> own;
  for (const auto& list : {model->states(), model->top_derivatives(), model->algebraic()})
    own.insert(list.begin(), list.end());
  std::erase_if(at->rows, [&](const LedgerRow& row) { return !own.count(row.leaf); });
  return at;
}

/// The value of a parameter, as in StartSystem; nothing where it has none.
std::optional<double> value_of(Expr p, const Model& model, const StartRequest& request) {
  std::optional<Expr> value = symbol_of(p).value;
  if (const auto own = model.values.find(p); own != model.values.end()) value = own->second;
  if (const auto it = request.parameters.find(p); it != request.parameters.end()) value = it->second;
  if (!value) return {};
  return value->is_constant() ? constant_value(*value) : pendula::evaluate({&*value, 1}, {})[0];
}

/// A start of x′ = f(t, x) with every state given needs no solution of equations. Empty if anything else is
/// requested or f is not finite.
ConsistentStatePtr explicit_start(const ModelPtr& model, const StartRequest& request) {
  if (model->residuals.size() != model->variables.size()) return nullptr;  // init() reports the imbalance
  const std::vector<Expr> states = model->states();
  if (states.empty() || request.fix.size() != states.size() || !request.guess.empty()) return nullptr;
  if (request.nearest || !model->invariants.empty() || !model->projections.empty()) return nullptr;
  const std::shared_ptr<const FirstOrder> all = shared_first_order(model);
  const FirstOrder& form = *all;
  if (!form.is_ode() || form.x != states) return nullptr;
  auto at = std::make_shared<ConsistentState>();
  at->model = model;
  at->t = request.t;
  at->request = request;
  at->values[time_symbol()] = request.t;
  for (const auto& [leaf, value] : request.fix) at->values[resolve(*model, leaf)] = value;
  const std::unordered_set<Expr> known(states.begin(), states.end());
  if (at->values.size() != states.size() + 1) return nullptr;
  for (const auto& [leaf, value] : at->values)
    if (leaf != time_symbol() && !known.count(leaf)) return nullptr;
  std::vector<Expr> parameters = form.p, leaves_given, inputs;
  for (const auto& [leaf, e] : request.inputs) {
    leaves_given.push_back(leaf);
    inputs.push_back(e);
  }
  for (Expr inside : leaves(inputs))
    if (symbol_of(inside).kind == Kind::parameter) parameters.push_back(inside);
  for (Expr p : parameters) {
    const auto value = value_of(p, *model, request);
    if (!value) return nullptr;
    at->values[p] = *value;
  }
  const std::vector<double> at_start = pendula::evaluate(inputs, at->values);
  for (std::size_t i = 0; i < inputs.size(); ++i) at->values[leaves_given[i]] = at_start[i];
  for (Expr u : form.u)
    if (!request.inputs.count(u)) return nullptr;
  const std::vector<double> f = pendula::evaluate(form.f, at->values);
  for (Expr state : states) at->rows.push_back({state, at->values.at(state), Origin::fixed});
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!std::isfinite(f[i])) return nullptr;
    const Expr slope = derivative_leaf(states[i]);
    if (known.count(slope)) continue;
    at->values[slope] = f[i];
    at->rows.push_back({slope, f[i], Origin::computed});
  }
  at->free = static_cast<int>(states.size());
  return at;
}

}  // namespace

/// Uses the declared start values of parts that have a guess; without them if that yields no start.
static ConsistentStatePtr init_with_declared(const ModelPtr& model, const StartRequest& request) {
  StartRequest released = request;
  released.declared.clear();
  StartRequest held = released;
  for (const auto& [leaf, value] : request.declared) {
    std::erase_if(held.guess, [leaf = leaf](const auto& entry) { return entry.first == leaf; });
    held.fix.emplace_back(leaf, value);
  }
  try {
    return init(model, held);
  } catch (const UserFacing&) {
    return init(model, released);
  }
}

/// Throws what explains why there is no solution.
static StartSolution solved_start(const ModelPtr& model, const StartSystem& s) {
  StartSolution solution = solve_start(s);
  if (!solution.solved && !solution.defined) explain_undefined(model, s);
  if (!solution.solved && solution.stuck) explain_stuck(s, *solution.stuck);
  if (!solution.solved)
    if (StartSolution other = solve_by_orders(model, s); other.solved) solution = std::move(other);
  if (!solution.solved)
    if (StartSolution other = solve_with_more_guesses(model, s); other.solved) solution = std::move(other);
  if (!solution.solved && s.request.nearest) solution = nearest_start(s);
  if (!solution.solved) explain_conflict(s, solution);
  return solution;
}

static Freedom cleaned_freedom(const StartSystem& s, StartSolution& solution) {
  clean(s, solution.w, solution.slow);
  if (solution.slow) clean_double_root(s, solution.w);
  return freedom(s, solution.w, solution.slow);
}

static ConsistentStatePtr finished(const ModelPtr& model, const StartSystem& s, const StartSolution& solution,
                                   const Freedom& open, const StartRequest& request) {
  if (!request.nearest && !solution.slow) require_regular_point(model, s, solution.w, open.count == 0);
  if (open.count > 0) explain_freedom(model, s, solution.w, open);
  auto at = std::make_shared<ConsistentState>();
  at->model = model;
  at->t = request.t;
  at->request = request;
  at->values = s.point(solution.w);
  const std::vector<char> exact = s.fixed();
  for (std::size_t j = 0; j < s.unknowns.size(); ++j)
    if (!exact[j]) at->units[s.unknowns[j]] = s.unit[j];
  if (request.nearest) at->moved = moved_values(s, solution.w);
  for (const auto& [leaf, value] : request.inputs)
    at->values[leaf] = pendula::evaluate({&value, 1}, at->values)[0];
  at->lost = solution.slow ? digits_at_double_root(s, solution.w) : lost_digits(s, solution.w);
  fill_ledger(*at, s, open);
  fill_constraints(*at, s, solution.w);
  if (!s.has_signs()) return at;
  if (ConsistentStatePtr decided = start_on_signs(model, request, *at)) return decided;
  return at;
}

/// At a point where the equations lose rank: the start by their square-free parts from there, if some have
/// repeated factors. Nothing if none has, or they do not hold there.
static ConsistentStatePtr start_without_repeated_factors(const ModelPtr& model, const StartSystem& s,
                                                         const Vec& w, const StartRequest& request) {
  constexpr double same = 1e-4;  // a double root is known to half of the digits, a triple one to a third
  const ModelPtr simple = without_repeated_factors(model, request.parameters);
  if (!simple) return nullptr;
  const StartSystem other(simple, request);
  const auto point = s.point(w);
  Vec from = first_point(other, 0);
  StartSolution solution =
      gauss_newton(other, from);  // its steps tell whether the root is still a double one
  for (Index j = 0; j < from.size(); ++j)
    if (const auto it = point.find(other.unknowns[j]); it != point.end()) from[j] = it->second;
  const Vec off = (solution.w - from).cwiseQuotient(other.unit + from.cwiseAbs());
  if (!solution.solved || !(off.cwiseAbs().maxCoeff() < same)) solution = gauss_newton(other, from);
  if (!solution.solved) return nullptr;
  const Freedom open = cleaned_freedom(other, solution);
  auto at = std::make_shared<ConsistentState>(*finished(simple, other, solution, open, request));
  at->model = model;
  at->values.insert(point.begin(), point.end());
  return at;
}

ConsistentStatePtr init(const ModelPtr& model, const StartRequest& request) {
  if (!request.declared.empty()) return init_with_declared(model, request);
  if (ConsistentStatePtr at = explicit_start(model, request)) {
    if (ConsistentStatePtr decided = start_on_signs(model, request, *at)) return decided;
    return at;
  }
  if (const ModelPtr relative = sparse_relative(model)) return init_by(relative, model, request);
  if (ConsistentStatePtr at = start_in_region(model, request)) return at;
  const StartSystem s(model, request);
  StartSolution solution = solved_start(model, s);
  const Freedom open = cleaned_freedom(s, solution);
  if (solution.slow || open.rank_equations < static_cast<int>(s.first_fix))
    if (ConsistentStatePtr at = start_without_repeated_factors(model, s, solution.w, request)) return at;
  return finished(model, s, solution, open, request);
}

}  // namespace pendula::dae
