#include "integrate/simulation/simulate.hpp"

#include <algorithm>
#include <string>

#include "integrate/problem/invariant_zeros.hpp"
#include "integrate/run/adaptive_run.hpp"
#include "integrate/run/fixed_step_run.hpp"
#include "integrate/simulation/array_run.hpp"
#include "integrate/simulation/branch_run.hpp"
#include "integrate/simulation/constraint_reselection.hpp"
#include "integrate/simulation/natural_sizes.hpp"
#include "integrate/simulation/preparation.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/regime_run.hpp"
#include "integrate/simulation/regrown_states.hpp"
#include "integrate/simulation/state_reselection.hpp"

namespace pendula::integrate {

/// A remark for a run that cannot take its first step.
static std::string where_solutions_meet(const Simulation& simulation) {
  if (!simulation.start || simulation.start->t != simulation.plan.from) return "";
  try {
    const std::string meeting = simulation.start->crossing();
    return meeting.empty() ? "" : ": " + meeting;
  } catch (const UserFacing&) {  // no remark
    return "";
  }
}

TrajectoryPtr simulate(const dae::ModelPtr& model, const Simulation& simulation) {
  if (simulation.branch) return simulate_branches(model, simulation);
  if (simulation.chosen != ChosenOutside::all && simulation.sensitivities.empty()) {
    if (simulation.chosen == ChosenOutside::nothing && leaves_out_constraints(model))
      return simulate_rekeeping(model, simulation);
    if (chooses_states(*model)) return simulate_reselecting(model, simulation);
    if (chooses_rows(*model, simulation)) return simulate_rechoosing(model, simulation);
  }
  if (!simulation.sensitivities.empty() && simulation.chosen == ChosenOutside::nothing &&
      !simulation.plan.dt && leaves_out_constraints(model))
    return simulate_keeping(model, simulation);
  if (changes_regime(*model, simulation)) return simulate_regimes(model, simulation);
  require_low_index(*model, simulation.plan.direct);
  const ProblemSetup run = set_up_problem(model, simulation);
  const auto wrap = [&](SolutionPtr solution) {
    return std::make_shared<const Trajectory>(model, simulation.inputs, std::move(solution),
                                              simulation.events, simulation.sensitivities, run.variational,
                                              simulation.start);
  };
  Plan plan = simulation.plan;
  if (plan.check_singularities) watch_singularities(plan, model, simulation, *run.problem);
  if (!plan.blocks.empty())
    plan.sizes = [problem = run.problem, start = run.start, from = plan.from, to = plan.to] {
      Problem own(*problem);  // a separate copy, since callbacks evaluate within a step
      return natural_sizes(own, start, from, to - from);
    };
  if (plan.dt)
    return wrap(simulation.method.multistep
                    ? integrate_bdf(run.problem, simulation.method.multistep, run.start, plan)
                    : integrate(run.problem, simulation.method.tableau, run.start, plan));
  const auto so_far = std::make_shared<TrajectoryPtr>();
  complete_plan(plan, model, simulation, run, so_far);
  if (!invariant_zeros(*run.problem).empty())
    plan.small_states.repeatable = repeatable_states(simulation, *model, *run.problem);
  if (plan.check_singularities && simulation.start && simulation.sensitivities.empty())
    plan.continuations = [&](const Point& p, bool here) {
      return continuations_at_end_text(model, simulation, (*so_far)->solution(), p, here);
    };
  const SolutionPtr solution = [&] {
    try {
      return integrate_adaptive(run.problem, simulation.method, run.start, plan,
                                [&](SolutionPtr running) { *so_far = wrap(std::move(running)); });
    } catch (const Failure& e) {
      so_far->reset();
      throw Failure(e.what() + where_solutions_meet(simulation));
    }
  }();
  so_far->reset();  // breaks the reference cycle between the callbacks and the solution
  if (solution->outcome().ending == Ending::regrowth)
    return simulate(model, following_small_states(simulation, *solution));
  return wrap(solution);
}

}  // namespace pendula::integrate
