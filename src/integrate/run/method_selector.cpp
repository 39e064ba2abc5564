#include "integrate/run/method_selector.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "integrate/run/methods.hpp"

namespace pendula::integrate {

MethodSelector::MethodSelector(AdaptiveState& state, const Method& method)
    : state_(state), method_(method), couplings_(DependencyGraph::of(*state.problem, state.plan.modes)) {}

void MethodSelector::start(const Point& point) {
  const Choice choice = is_automatic() ? choose(state_.problem, method_, state_.plan, point, couplings_)
                                       : Choice{method_.family, method_.tableau, ""};
  method_.tableau = choice.tableau;
  rival_ = choice.rival;
  // What has been counted is kept until the run has turned out to be one of the hardest: first steps are small, and of
  // BDF many.
  constexpr double hardest = 3;  // usual_radau_steps()
  look_.next = std::max(look_.next, std::lround(hardest * rival_.usual_steps));
  use(*choice.family, point, choice.why);
}

void MethodSelector::use(const MethodFamily& family, const Point& point, const std::string& why) {
  family_ = &family;
  state_.history->use(make_stepper(family, state_.problem, method_, state_.plan, state_.stats(), couplings_));
  Stepper& stepper = state_.stepper();
  stepper.start(point, state_.end);
  name_ += (name_.empty() ? "" : ", then ") + stepper.name();
  state_.solution->set_method(name_, 0);
  if (!why.empty()) state_.solution->add_method({point.t, stepper.name(), why});
  state_.reached = point.t;
}

void MethodSelector::renew() {
  state_.history->use(
      make_stepper(*family_, state_.problem, method_, state_.plan, state_.stats(), couplings_));
}

/// Goes on with another method from here.
void MethodSelector::change(const MethodFamily& family, double dt, const std::string& why) {
  const Point here = state_.stepper().here();
  const double first = state_.plan.dt_first;
  state_.plan.dt_first = dt;
  use(family, here, why);
  state_.plan.dt_first = first;
}

void MethodSelector::step() {
  try {
    return state_.stepper().step(state_.end);
  } catch (const Failure& failure) {
    if (!is_automatic() || !state_.stepper().is_explicit()) throw;
    const std::string reason = failure.what(), name = name_;
    const std::size_t uses = state_.solution->methods_in_use().size();
    try {
      change(family::radau, 0, "the explicit method could not go on");
      state_.stepper().step(state_.end);
    } catch (const Failure&) {
      state_.solution->keep_methods(uses);
      name_ = name;
      state_.solution->set_method(name_, 0);
      throw Failure(reason);
    }
  }
}

void MethodSelector::change_if_it_pays() {
  if (!is_automatic() || state_.problem->has_dense_jacobian()) return;
  if (!state_.stepper().is_explicit())
    leave_implicit();
  else if (state_.stepper().is_stiff())
    leave_explicit();
  else if (past_.compare_at > 0)
    judge_change();
}

double MethodSelector::work() {
  const Stats& s = state_.stats();
  // an evaluation, and a stage's share of a solution
  const int passes = state_.stepper().is_explicit() ? 1 : 2;
  const double factorisation = implicit_cost(state_.problem->n() + state_.problem->m());
  return static_cast<double>(passes * s.evaluations + s.newton_iterations + s.jacobians) +
         factorisation * static_cast<double>(s.factorisations);
}

void MethodSelector::leave_explicit() {
  constexpr double clearly = 2;
  // Steps that stability alone limits: nothing but stiffness is left, for which some 12 steps of a Rosenbrock method
  // do, a third of what a whole run takes.
  constexpr double share = 0.4;
  const Problem& problem = *state_.problem;
  double next = state_.stepper().next_dt();
  if (rival_.family) next = std::max(next, state_.stepper().here().t - state_.stepper().before().t);
  const MethodFamily& implicit =
      rival_.family ? *rival_.family : implicit_family(problem, method_, state_.plan);
  const double worth = rival_.family ? clearly * rival_.worth_explicit_steps()
                                     : (&implicit == &family::rosenbrock ? share : 1) *
                                           worth_explicit_steps(implicit, problem.n() + problem.m());
  if (state_.plan.to - state_.stepper().here().t < worth * next) return;
  look_ = {state_.stats().steps + look_.apart, look_.apart, 0};
  change(implicit, next, "stiff: stability, not accuracy, limited the steps");
}

/// Eigenvalues tell the steps that stability allows, not those that accuracy asks for, nor what z costs in each of them:
/// an explicit method that has turned out to be more work than the implicit one before is left again.
void MethodSelector::judge_change() {
  constexpr double clearly = 1.2;
  const long steps = state_.stats().steps;
  if (steps == past_.begin_at) {
    past_.t = state_.stepper().here().t;
    past_.work = work();
  }
  if (steps < past_.compare_at) return;
  past_.compare_at = 0;
  const double elapsed = state_.stepper().here().t - past_.t;
  if (work() - past_.work <= clearly * past_.per_time * elapsed) return;
  look_.apart = 4 * look_.apart;
  look_ = {state_.stats().steps + look_.apart, look_.apart, 0};
  change(implicit_family(*state_.problem, method_, state_.plan), past_.dt,
         "the explicit method takes more work: its steps are too short, or z costs too much in each");
}

/// Eigenvalues are looked at seldom, and twice, some steps apart: where a relaxation oscillation jumps it is not stiff
/// for a moment. Every change makes the next one less likely.
void MethodSelector::leave_implicit() {
  constexpr long few = 10, seldom = 400, first = 5, enough = 20;  // steps
  constexpr double worth = 50;                                    // steps that remain
  const long steps = state_.stats().steps;
  if (steps < look_.next) return;
  const bool high_index = std::any_of(state_.plan.variable_index.begin(), state_.plan.variable_index.end(),
                                      [](int i) { return i > 1; });
  if (high_index || couplings_ || method_.explicit_choice.empty() || state_.problem->n() == 0) return;
  const Point& here = state_.stepper().here();
  const double dt = here.t - state_.stepper().before().t;
  if (state_.plan.to - here.t < worth * dt ||
      !is_cheaper_explicit(state_.problem, here, dt, *family_, rival_)) {
    look_.apart = std::min(2 * look_.apart, seldom);
    look_.next = steps + look_.apart;
    look_.favourable = 0;
    return;
  }
  look_.next = steps + few;
  if (++look_.favourable < 2) {
    past_.t = here.t;
    past_.work = work();
    return;
  }
  look_.apart = 4 * look_.apart;
  past_.per_time = (work() - past_.work) / (here.t - past_.t);
  past_.dt = dt;
  past_.begin_at = steps + first;
  past_.compare_at = rival_.family ? 0 : steps + enough;
  method_.tableau = rival_.family ? method_.explicit_choice.back() : explicit_pair_for(method_, state_.plan);
  change(family::explicit_pair, 0, "no longer stiff: eigenvalues of ∂x′/∂x are small beside 1/(step size)");
}

}  // namespace pendula::integrate
