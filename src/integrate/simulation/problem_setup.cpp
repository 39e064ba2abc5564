#include "integrate/simulation/problem_setup.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/structure/variable_levels.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/pulses.hpp"
#include "integrate/event/resets.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/run/methods.hpp"
#include "integrate/simulation/preparation.hpp"
#include "integrate/simulation/usual_tolerances.hpp"

namespace pendula::integrate {

void require_low_index(const dae::Model& model, bool direct) {
  constexpr std::size_t affordable =
      500;  // equations of a structurally singular model; larger ones are judged numerically by the stepper
  if (direct || model.form == "ggl") return;  // form "ggl" is integrated at index 2 by design
  const dae::Analysis analysis = dae::analyse(model);
  if (analysis.regular && analysis.index <= 1) return;
  if (!analysis.regular && model.residuals.size() > affordable) return;
  int index = 0;
  try {
    index = dae::differentiation_index(model, analysis).index;
  } catch (const Failure&) {
    if (analysis.regular) throw;
    return;
  }
  if (!analysis.regular && index <= 1) return;
  if (index <= 1)
    throw Error(
        text("the model has index 1, but x′ and z do not follow from its equations as they stand ",
             "(structural index ", analysis.index, "): a differentiated combination of them is needed. ",
             "Integrate sys:reduce():integrate{…}, or the equations as they stand with direct = true and ",
             "method = \"radau\""));
  throw Error(text("the model has index ", index, "; integration needs index 0 or 1. Integrate a reduced ",
                   "form: sys:reduce():integrate{…}, or sys:reduce \"acc\" to see the drift, or study the ",
                   "model as it stands with direct = true"));
}

static double parameter_value(Expr p, const dae::Model& model, const Simulation& simulation) {
  std::optional<Expr> value = symbol_of(p).value;
  if (const auto it = model.values.find(p); it != model.values.end()) value = it->second;
  if (const auto it = simulation.parameters.find(p); it != simulation.parameters.end()) value = it->second;
  if (!value) {
    const std::string name = to_text(p);
    throw Error(text("the parameter '", name, "' has no value; give params = { ", name,
                     " = … } or use sys:with{ ", name, " = … }"));
  }
  return value->is_constant() ? constant_value(*value) : evaluate(std::span(&*value, 1), {})[0];
}

static Problem::Input input_of(Expr leaf, const Simulation& simulation) {
  for (const auto& [known, function] : simulation.numeric_inputs)
    if (known == leaf) return function;
  const std::string name = to_text(symbol_of(leaf).base);
  for (const auto& [known, function] : simulation.numeric_inputs)
    if (known == symbol_of(leaf).base) {
      throw Error(text("the equations contain ", to_text(leaf), ", but the function given for the input '",
                       name, "' could not be followed symbolically; give an expression in t instead"));
    }
  throw Error(text("the input '", name, "' has no values; give inputs = { ", name, " = function(t) … end }"));
}

static Point starting_point(const dae::ConsistentState& start, const dae::FirstOrder& form) {
  const auto value = [&](Expr leaf) {
    const auto it = start.values.find(leaf);
    return it == start.values.end() ? 0.0 : it->second;
  };
  Point point;
  point.x.resize(static_cast<Eigen::Index>(form.x.size()));
  point.xdot.resize(point.x.size());
  point.z.resize(static_cast<Eigen::Index>(form.z.size()));
  for (std::size_t i = 0; i < form.x.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    PENDULA_ASSERT(start.values.count(form.x[i]), "a start without a value for a state");
    point.x[k] = value(form.x[i]);
    point.xdot[k] = value(derivative_leaf(form.x[i]));  // also if x′ is represented by a slot
  }
  for (std::size_t i = 0; i < form.z.size(); ++i) point.z[i] = value(form.z[i]);
  return point;
}

/// One number for every unknown in (x, z).
static Vec tolerance(const ToleranceRequest& request, const Vec& usual, const dae::Model& model,
                     const Problem& problem, const std::string& what) {
  const dae::FirstOrder& form = problem.model();
  std::vector<Expr> unknowns = form.x;
  unknowns.insert(unknowns.end(), form.z.begin(), form.z.end());
  Vec result = request.all ? Vec::Constant(usual.size(), *request.all) : usual;
  if (!request.list.empty()) {
    const auto given = request.list.size(), n = static_cast<std::size_t>(problem.visible_n()),
               m = static_cast<std::size_t>(problem.visible_m());
    if (given != n && given != n + m)
      throw Error(text(what, " has ", given, " entries for ", n, " states and ", m, " algebraic variables"));
    for (std::size_t i = 0; i < given; ++i) result[i < n ? i : form.x.size() + i - n] = request.list[i];
  }
  for (const auto& [leaf, value] : request.some) {
    const Expr own = dae::resolve(model, leaf);
    const auto at = std::find(unknowns.begin(), unknowns.end(), own);
    if (at == unknowns.end())
      throw Error(text(what, ": ", to_text(leaf), " is not a state or an algebraic variable of this model"));
    result[at - unknowns.begin()] = value;
  }
  return result;
}

/// The index of each unknown, 1 + C - d + order of derivative (dae/structure/variable_levels.hpp).
static std::vector<int> variable_indices(const dae::Model& model, const Problem& problem) {
  const dae::FirstOrder& form = problem.model();
  const dae::Analysis analysis = dae::analyse(model);
  std::vector<int> result(form.x.size() + form.z.size(), 1);
  if (!analysis.regular || analysis.index < 2) return result;
  const std::vector<int> levels = dae::variable_levels(analysis.sigma, analysis.offsets);
  const auto index_of = [&](Expr leaf) {
    for (std::size_t j = 0; j < model.variables.size(); ++j)
      if (model.variables[j].leaf == symbol_of(leaf).base || model.variables[j].leaf == leaf)
        return std::max(1, 1 + levels[j] - analysis.offsets.d[j] + symbol_of(leaf).order);
    return 1;
  };
  // Sensitivities follow the unknowns, in blocks of the same order, and share their indices.
  const auto n = static_cast<std::size_t>(problem.visible_n()),
             m = static_cast<std::size_t>(problem.visible_m());
  for (std::size_t i = 0; i < form.x.size(); ++i) result[i] = index_of(form.x[i % n]);
  for (std::size_t i = 0; i < form.z.size(); ++i) result[form.x.size() + i] = index_of(form.z[i % m]);
  return result;
}

/// The tolerance of S = ∂x/∂p is that of x per unit of p: atol_S = atol_x/|p|.
static void scale_sensitivities(Tolerances& tolerances, Problem& problem, const Variational* all) {
  if (!all) return;
  const auto& p = problem.model().p;
  const double* values = problem.values().data() + problem.values().size() - p.size();
  for (std::size_t j = 0; j < all->with_respect_to.size(); ++j) {
    const auto at = std::find(p.begin(), p.end(), all->with_respect_to[j]);
    const double size = at == p.end() ? 1 : std::fabs(values[at - p.begin()]);
    const auto block = static_cast<Eigen::Index>(j + 1);
    const auto copy = [&](Eigen::Index first, Eigen::Index count, Eigen::Index base) {
      tolerances.atol.segment(first, count) = tolerances.atol.segment(base, count) / (size > 0 ? size : 1);
      tolerances.rtol.segment(first, count) = tolerances.rtol.segment(base, count);
    };
    copy(block * all->n, all->n, 0);
    copy(problem.n() + block * all->m, all->m, problem.n());
  }
}

/// Adds the derivatives of an event's time and reset values with respect to the sensitivity parameters.
static void add_tangents(Event& event, const Variational& all) {
  const auto derivatives = [&](Expr e) {
    std::vector<Expr> list;
    for (int j = 0; j < static_cast<int>(all.with_respect_to.size()); ++j)
      list.push_back(all.derivative(e, j));
    return list;
  };
  event.tangent = derivatives(event.when);
  for (const auto& [state, value] : event.reset) {
    event.reset_tangent.push_back(derivatives(value));
    event.reset_tangent.back().push_back(total_derivative(value));
  }
}

/// Rejects, for direct = true, methods whose algebraic variables diverge or converge too slowly.
static void require_convergence(const Method& method, const std::vector<int>& indices) {
  const int index = indices.empty() ? 1 : *std::max_element(indices.begin(), indices.end());
  if (index < 2) return;
  if (!method.family) return;
  const std::string objection = method.family->objection_to_index_2(method);
  if (!objection.empty())
    throw Error(text(
        "the method ", name_of(method), " ", objection, ", but this model has index ", index,
        "; take method = \"radau\", or sys:reduce():integrate{…}. Fixed steps (dt = …) show what happens"));
}

/// Translates an event to leaves of the problem.
static Event event_of(const ModelEvent& request, const dae::ModelPtr& model, const Substitution& inputs,
                      const std::shared_ptr<TrajectoryPtr>& so_far) {
  const auto own = [&](Expr e) { return substitute(dae::resolve(*model, e), inputs); };
  Event event;
  event.when = own(request.when);
  event.direction = request.direction;
  event.stop = request.stop;
  for (const auto& [state, value] : request.reset)
    event.reset.emplace_back(dae::resolve(*model, state), own(value));
  if (request.call) {
    event.call = [call = request.call, so_far, model](const Point&) {
      EventReply reply = call(*so_far);
      for (auto& [state, value] : reply.reset) state = dae::resolve(*model, state);
      return reply;
    };
  }
  return event;
}

static void add_surfaces(Plan& plan, const ProblemSetup& run) {
  if (!run.piecewise) return;
  const std::vector<Surface>& surfaces = run.piecewise->surfaces();
  for (std::size_t k = 0; k < surfaces.size(); ++k) {
    Event event;
    event.when = surfaces[k].when;
    event.surface = true;
    event.surface_number = k;
    event.smoothness = surfaces[k].smoothness;
    event.is_edge = surfaces[k].is_edge;
    event.modes = surfaces[k].modes;
    plan.events.list.push_back(event);
  }
  plan.modes = run.piecewise->modes();
  plan.treat = run.treat;
}

static void add_events(Plan& plan, const dae::ModelPtr& model, const Simulation& simulation,
                       const ProblemSetup& run, const std::shared_ptr<TrajectoryPtr>& so_far) {
  bool resets = false;
  for (const ModelEvent& request : simulation.events) {
    plan.events.list.push_back(event_of(request, model, simulation.inputs, so_far));
    resets = resets || request.call || !request.reset.empty();
  }
  if (resets) plan.events.reinitialise = reinitialiser(*model, run.problem, simulation.inputs);
  if (resets && run.variational && plan.events.reinitialise)
    throw Error("sensitivities do not follow resets of a model whose states obey constraints");
  add_surfaces(plan, run);
  if (run.variational)
    for (Event& event : plan.events.list) add_tangents(event, *run.variational);
  for (const Guard& guard : plan.guards) {
    Event event;
    event.when = guard.factor;
    event.termination_reason = guard.reason;
    plan.events.list.push_back(event);
  }
}

/// Pulses of the inputs. An input that cannot be evaluated everywhere in the interval is monitored by the
/// steps alone, since an event may end the run before.
static std::vector<double> input_pulses(const Plan& plan) {
  try {
    return pulse_times(plan.monitored_inputs, plan.from, plan.to);
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception&) {
    return {};
  }
}

/// Makes steps end inside short pulses of functions of time.
static void add_pulses(Plan& plan, const Problem& problem) {
  if (plan.dt) return;
  std::vector<double> pulses = input_pulses(plan);
  if (contains_time(problem)) {
    const dae::FirstOrder& form = problem.model();
    const std::span<const double> values(problem.values());
    static PerEquations<std::vector<Expr>> known;
    const auto& functions = known.of(problem, [&] { return functions_of_time(form.F, form.p); });
    const auto own = pulse_times(functions, form.p, values.last(form.p.size()), plan.from, plan.to);
    pulses.insert(pulses.end(), own.begin(), own.end());
  }
  if (pulses.empty()) return;
  plan.breaks.insert(plan.breaks.end(), pulses.begin(), pulses.end());
  std::sort(plan.breaks.begin(), plan.breaks.end());
}

void complete_plan(Plan& plan, const dae::ModelPtr& model, const Simulation& simulation,
                   const ProblemSetup& run, const std::shared_ptr<TrajectoryPtr>& so_far) {
  const Vec atol = usual_atol(simulation, run.problem, run.start);
  plan.tolerances.rtol = tolerance(simulation.rtol, Vec::Constant(atol.size(), usual_rtol(simulation)),
                                   *model, *run.problem, "rtol");
  plan.tolerances.atol = tolerance(simulation.atol, atol, *model, *run.problem, "atol");
  scale_sensitivities(plan.tolerances, *run.problem, run.variational.get());
  if (plan.direct || model->form == "ggl") {
    plan.variable_index = variable_indices(*model, *run.problem);
    plan.tolerances.time = multiplier_times(simulation, run.problem, run.start, plan.variable_index);
  }
  plan.has_chains = model->form == "array";
  require_convergence(simulation.method, plan.variable_index);
  add_pulses(plan, *run.problem);
  add_events(plan, model, simulation, run, so_far);
}

Mat start_sensitivity(const Variational& all, const dae::Model& model, const dae::ConsistentState& start,
                      const Substitution& inputs, std::unordered_map<Expr, double> values) {
  for (const auto& [leaf, value] : start.values) values.try_emplace(leaf, value);
  std::vector<Expr> conditions;
  for (const dae::Constraint& c : state_conditions(model)) {
    const Expr e = substitute(dae::resolve(model, c.residual), inputs);
    const std::vector<Expr> inside = leaves({&e, 1});
    const auto& z = all.form.z;
    if (std::none_of(inside.begin(), inside.end(),
                     [&](Expr leaf) { return std::find(z.begin(), z.end(), leaf) != z.end(); }))
      conditions.push_back(e);
  }
  std::vector<char> held(static_cast<std::size_t>(all.n), 1);
  for (const dae::LedgerRow& row : start.rows)
    for (int i = 0; i < all.n; ++i)
      if (all.form.x[i] == row.leaf && row.origin == dae::Origin::computed) held[i] = 0;
  return initial_sensitivity(all, conditions, held, values);
}

/// Appends S(0) to x(0); S′ and Z follow from the equations.
static void extend_start(Point& start, const Variational& all, const dae::Model& model,
                         const Simulation& simulation, const Vec& parameters) {
  std::unordered_map<Expr, double> values;
  values[time_symbol()] = simulation.plan.from;
  for (std::size_t i = 0; i < all.form.p.size(); ++i) values[all.form.p[i]] = parameters[i];
  const Mat S = start_sensitivity(all, model, *simulation.start, simulation.inputs, std::move(values));
  const Point base = start;
  const auto k = static_cast<Eigen::Index>(all.with_respect_to.size());
  start.x = Vec::Zero(all.n * (k + 1));
  start.xdot = start.x;
  start.z = Vec::Zero(all.m * (k + 1));
  start.x.head(all.n) = base.x;
  start.xdot.head(all.n) = base.xdot;
  start.z.head(all.m) = base.z;
  start.x.tail(all.n * k) = S.reshaped();
}

static void refuse_calls(const std::vector<ModelEvent>& events) {
  for (const ModelEvent& event : events)
    if (event.call)
      throw Error(
          "sensitivities do not follow through events that call; use reset = { … } or action = \"stop\"");
}

/// What x′ = f has divided by, where only parameters decide whether that is 0.
static std::vector<dae::Solved> parametric_rows(const dae::ModelPtr& model) {
  static dae::PerModel<std::shared_ptr<const std::vector<dae::Solved>>> known;
  return *known.of(model, [&] {
    auto rows = std::make_shared<std::vector<dae::Solved>>();
    if (dae::shared_first_order(model)->semi_explicit)
      for (const dae::Solved& row : dae::solved_rows(*model))
        if (const auto inside = leaves({&row.slope, 1});
            !inside.empty() && std::all_of(inside.begin(), inside.end(),
                                           [](Expr leaf) { return symbol_of(leaf).kind == Kind::parameter; }))
          rows->push_back(row);
    return std::shared_ptr<const std::vector<dae::Solved>>(rows);
  });
}

/// Rejects ε z′ = f at ε = 0: z is no state there.
static void require_leading_coefficients(const dae::ModelPtr& model, const Simulation& simulation) {
  for (const dae::Solved& row : parametric_rows(model)) {
    std::unordered_map<Expr, double> values;
    std::vector<std::string> words;
    for (Expr p : leaves({&row.slope, 1})) {
      values[p] = parameter_value(p, *model, simulation);
      words.push_back(text(to_text(p), " = ", rounded(values[p])));
    }
    if (evaluate({&row.slope, 1}, values)[0] != 0) continue;
    throw Error(text(to_text(row.derivative), " is not finite there: with ", join(words, ", "),
                     " the equation ", model->label(row.residual), "  ", model->equation_text(row.residual),
                     " does not contain it (its factor ", to_text(row.slope), " is 0), and ",
                     to_text(symbol_of(row.derivative).base),
                     " is no state. Integrate the form of that case: sys:with{ ", join(words, ", "),
                     " }:reduce():integrate{…}"));
  }
}

ProblemSetup set_up_problem(const dae::ModelPtr& model, const Simulation& simulation) {
  if (!simulation.sensitivities.empty()) refuse_calls(simulation.events);
  const PreparationPtr all = prepared(model, simulation);
  Vec parameters(static_cast<Eigen::Index>(all->form.p.size()));
  for (std::size_t i = 0; i < all->form.p.size(); ++i)
    parameters[i] = parameter_value(all->form.p[i], *model, simulation);
  require_leading_coefficients(model, simulation);
  std::vector<Problem::Input> inputs;
  for (Expr u : all->form.u) inputs.push_back(input_of(u, simulation));
  if (!all->serves(parameters)) complete(*all, parameters, simulation);
  ProblemSetup result;
  result.piecewise = all->piecewise;
  result.variational = all->variational;
  result.start = starting_point(*simulation.start, all->form);
  const int modes = all->piecewise ? all->piecewise->modes() : 0;
  parameters.conservativeResize(parameters.size() + modes);
  parameters.tail(modes).setOnes();
  if (all->variational) extend_start(result.start, *all->variational, *model, simulation, parameters);
  result.problem = std::make_shared<Problem>(*all->problem);
  result.problem->set_numbers(parameters, inputs);
  if (!all->piecewise || all->piecewise->surfaces().empty()) return result;
  result.treat = [all, parameters, inputs, piecewise = all->piecewise, variational = all->variational](
                     const std::vector<Treatment>& treatment,
                     const std::unordered_map<Expr, double>& at) -> TreatedProblem {
    SlidingForm treated = piecewise->form(treatment, at);
    std::vector<dae::Projection> stages = all->stages;
    if (!treated.conditions.empty())
      stages.push_back(
          {treated.form.x, treated.conditions, sparse_jacobian(treated.conditions, treated.form.x), {}});
    if (variational) treated.form = integrate::variational(treated.form, variational->with_respect_to).form;
    auto problem = std::make_shared<Problem>(std::move(treated.form), parameters, inputs);
    problem->set_visible_size(all->problem->visible_n(), all->problem->visible_m(),
                              all->problem->sensitivities());
    problem->set_projections(stages);
    return {problem, treated.weights};
  };
  return result;
}

ProblemPtr make_problem(const dae::ModelPtr& model, const Simulation& simulation) {
  Simulation bare = simulation;
  bare.sensitivities.clear();
  bare.many_parameters = true;
  auto anywhere = std::make_shared<dae::ConsistentState>();
  for (Expr x : model->states()) anywhere->values[x] = 0;
  bare.start = anywhere;
  return set_up_problem(model, bare).problem;
}

}  // namespace pendula::integrate
