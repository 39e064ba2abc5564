#include "integrate/run/method_selector.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "integrate/run/methods.hpp"
#include "integrate/run/step_work.hpp"

namespace pendula::integrate {

MethodSelector::MethodSelector(AdaptiveState& state, const Method& method)
    : state_(state), method_(method), couplings_(DependencyGraph::of(*state.problem, state.plan.modes)) {}

void MethodSelector::start(const Point& point) {
  const Choice choice = is_automatic() ? choose(state_.problem, method_, state_.plan, point, couplings_)
                                       : Choice{method_.family, method_.tableau, ""};
  method_.tableau = choice.tableau;
  costs_ = choice.costs;
  use(*choice.family, point, choice.why);
  // The steps counted at the choice of the method hold until the run proves unusually long; early steps are
  // small, and with BDF many.
  constexpr double hardest = 3;  // usual_radau_steps()
  forecast_.wait_until(std::lround(hardest * costs_.usual_steps));
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
  begin_counting();
}

/// Starts to measure the work of the method in use.
void MethodSelector::begin_counting() {
  // explicit steps per implicit step where accuracy limits both: docs/performance.md
  constexpr double of_rosenbrock = 0.4, of_radau = 1.5;
  const long steps = state_.stats().steps;
  if (!is_automatic()) return;
  steady_.begin();
  if (state_.stepper().is_explicit()) {
    past_.begin = steps;
    trial_.next = trial_.favourable = 0;
    trial_.begun = state_.stats();
    trial_.t = state_.stepper().here().t;
    return;
  }
  constexpr long often = 4, seldom = 16;  // steps between inspections, each of which costs some evaluations
  const bool is_small = state_.problem->n() + state_.problem->m() <= StepWork::small;
  forecast_.begin({steps, work()}, family_ == &family::rosenbrock ? of_rosenbrock : of_radau,
                  is_small ? often : seldom);
}

void MethodSelector::renew() {
  state_.history->use(
      make_stepper(*family_, state_.problem, method_, state_.plan, state_.stats(), couplings_));
}

/// Changes to another method at the present point.
void MethodSelector::change(const MethodFamily& family, double dt, const std::string& why) {
  const Point here = state_.stepper().here();
  const double first = state_.plan.dt_first;
  state_.plan.dt_first = dt;
  use(family, here, why);
  state_.plan.dt_first = first;
}

bool MethodSelector::start_implicitly(const Point& point) {
  if (!is_automatic() || !state_.stepper().is_explicit()) return false;
  needs_implicit_ = true;
  use(family::radau, point, "an explicit method cannot slide along this border");
  return true;
}

/// If the method in use fails, one of the other kind may succeed: radau for an explicit one, and an explicit
/// one where it has been in use before.
void MethodSelector::step() {
  constexpr int most_failures_recovered = 3;
  try {
    return state_.stepper().step(state_.end);
  } catch (const Failure& failure) {
    const bool was_explicit = state_.stepper().is_explicit();
    if (!is_automatic() ||
        !(was_explicit || (method_.tableau && failures_recovered_++ < most_failures_recovered)))
      throw;
    const std::string reason = failure.what(), name = name_;
    const std::size_t uses = state_.solution->methods_in_use().size();
    try {
      if (was_explicit)
        change(family::radau, 0, "the explicit method could not go on");
      else
        change(family::explicit_pair, 0, "the implicit method could not go on");
      state_.stepper().step(state_.end);
    } catch (const Failure&) {
      state_.solution->keep_methods(uses);
      name_ = name;
      state_.solution->set_method(name_, 0);
      throw Failure(reason);
    }
  }
}

void MethodSelector::change_method_if_cheaper() {
  if (!is_automatic() || state_.problem->has_dense_jacobian()) return;
  steady_.add(state_.stepper().here().t - state_.stepper().before().t);
  if (!state_.stepper().is_explicit())
    leave_implicit();
  else if (state_.stepper().is_stiff())
    leave_explicit();
  else if (!past_.is_judged)
    judge_change();
  else if (!try_where_steps_cost_more())
    try_implicit();
}

double MethodSelector::work() { return work_of(state_.stats()); }

double MethodSelector::work_of(const Stats& s) {
  const bool is_explicit = state_.stepper().is_explicit();
  if (costs_.family) {
    const double step = is_explicit ? costs_.explicit_step : costs_.implicit_step;
    return static_cast<double>(s.steps + s.rejected) * step / costs_.explicit_step;
  }
  if (!explicit_) explicit_ = explicit_work(state_.problem, method_, state_.plan);
  const int passes = is_explicit ? 1 : 2;  // an evaluation, and a stage's share of a solution
  const double factorisation = implicit_cost(state_.problem->n() + state_.problem->m());
  const double all = static_cast<double>(passes * s.evaluations + s.newton_iterations + s.jacobians) +
                     factorisation * static_cast<double>(s.factorisations);
  return all / explicit_->step;
}

const MethodFamily& MethodSelector::implicit() const {
  if (costs_.family) return *costs_.family;
  return is_lasting_ ? family::radau : implicit_family(*state_.problem, method_, state_.plan);
}

double MethodSelector::left() const { return state_.plan.to - state_.stepper().here().t; }

// Derivation of the constants below: docs/derivations.md#choice-of-the-method;
// measurements: docs/performance.md.

void MethodSelector::leave_explicit() {
  constexpr double clearly = 2;
  // Small models: stability alone has limited the steps, so only stiffness is left, which takes a Rosenbrock
  // method some 12 steps, a third of a whole run.
  constexpr double share = 0.4;
  const Problem& problem = *state_.problem;
  double next = state_.stepper().next_dt();
  if (costs_.family) next = std::max(next, state_.stepper().here().t - state_.stepper().before().t);
  if (is_known_to_cost_less(next)) return;
  const double worth = costs_.family ? clearly * costs_.worth_explicit_steps()
                                     : (&implicit() == &family::rosenbrock ? share : 1) *
                                           worth_explicit_steps(implicit(), problem.n() + problem.m());
  if (left() < worth * next) return;
  if (past_.per_time > 0) forecast_.lengthen_stretch();
  change(implicit(), next, "stiff: stability, not accuracy, limited the steps");
}

/// Can explicit steps limited by stability to dt be less work than implicit ones nevertheless, as on the slow
/// part of a relaxation oscillation? If many such steps follow, it is not such a part.
bool MethodSelector::is_known_to_cost_less(double dt) {
  constexpr double clearly = 1.5;
  constexpr long one_stretch = 25;  // steps
  const long steps = state_.stats().steps;
  if (past_.per_time == 0 || (past_.stayed > 0 && steps - past_.stayed < one_stretch)) return false;
  if (clearly * past_.per_time * dt < 1) return false;
  past_.stayed = steps;
  state_.stepper().restart_stiffness_test();
  return true;
}

/// Leaves an explicit method again if it takes more work than the implicit one before. The change was based
/// on eigenvalues, which determine the steps allowed by stability, but not those required by accuracy nor the
/// cost of z. After the slow part of a relaxation oscillation extra work is admitted for a jump.
void MethodSelector::judge_change() {
  constexpr double clearly = 1.2, jump = 40;  // explicit steps
  constexpr long first = 5, enough = 15;      // steps
  constexpr double stretches = 4;             // relative to the length of the preceding implicit stretch
  const long steps = state_.stats().steps;
  if (steps <= past_.begin + first) {
    past_.t = state_.stepper().here().t;
    past_.work = work();
  }
  if (steps < past_.begin + first + enough) return;
  const double elapsed = state_.stepper().here().t - past_.t;
  if (work() - past_.work <= clearly * past_.per_time * elapsed + jump) {
    past_.is_judged = elapsed > stretches * past_.span;
    return;
  }
  forecast_.lengthen_stretch();
  change(implicit(), past_.dt,
         "the explicit method takes more work: its steps are too short, or z costs too much in each");
}

/// Tries an implicit method where the explicit steps are well inside the region of stability. Accuracy can
/// keep them there while fast modes follow a slow forcing (HW §IV.15); only a trial shows whether implicit
/// steps would be longer.
void MethodSelector::try_implicit() {
  constexpr double many = 150, dominant = 0.9, growing = 0.25, least = 0.3;
  constexpr long again = 12, later = 160;  // steps
  constexpr int looks = 4;
  const long steps = state_.stats().steps - past_.begin;
  if (steady_.count() < trial_.first) trial_.favourable = 0;
  if (costs_.family || state_.plan.modes > 0 || steady_.count() < trial_.first || steps < trial_.next) return;
  const double dt = steady_.mean();
  trial_.next = steps + later;
  const bool is_known = past_.per_time > 0 && past_.per_time * dt > 1;  // the implicit method took more work
  if (is_known || !may_become_explicit() || left() < many * dt) return;
  Stats unused;
  RhsSolver derivative(state_.problem, unused);
  Point at = state_.stepper().here();
  if (!derivative(at.t, at.x.data(), at.xdot.data(), at.z.data()) || !derivative.is_regular()) return;
  const auto now = rates(derivative, at);
  const bool decays = now && now->damped >= dominant * now->fastest && now->growing <= growing * now->damped;
  trial_.favourable = decays && now->damped * dt >= least ? trial_.favourable + 1 : 0;
  if (trial_.favourable > 0) trial_.next = steps + again;
  if (trial_.favourable < looks) return;
  trial_.first *= 8;
  forecast_.learn(now->fastest * dt);
  change(implicit(), dt, "modes that decay fast keep the explicit steps short: implicit ones are tried");
  forecast_.put_on_trial();
}

/// Tries an implicit method where a step takes far more work than its stages: z is looked at on many borders,
/// or its branch must be followed. What implicit steps would take then, nothing but a trial shows.
bool MethodSelector::try_where_steps_cost_more() {
  constexpr double more = 1.5;  // than usual: a trial is a tenth of the steps before and behind it
  constexpr long enough = 100;  // steps
  const long steps = state_.stats().steps - past_.begin;
  if (state_.problem->is_ode() || costs_.family || steps < trial_.costly || past_.per_time > 0) return false;
  trial_.costly = 2 * steps;
  const double elapsed = state_.stepper().here().t - trial_.t, dt = elapsed / static_cast<double>(steps);
  const double taken = work() - work_of(trial_.begun);
  if (taken < more * static_cast<double>(steps) || left() < enough * dt || !may_become_explicit())
    return false;
  change(implicit(), dt, "the explicit steps take far more work than their stages: implicit ones are tried");
  forecast_.put_on_trial(taken / elapsed);
  return true;
}

void MethodSelector::leave_implicit() {
  const long steps = state_.stats().steps;
  const Point& here = state_.stepper().here();
  const double dt = here.t - state_.stepper().before().t;
  forecast_.step(dt);
  if (higher_order_is_cheaper()) {
    is_lasting_ = true;
    return change(family::radau, dt, "the steps are many and alike: a higher order takes fewer");
  }
  if (!forecast_.is_due(steps) || !may_become_explicit()) return;
  forecast_.measure(state_.problem, here, {steps, work()});
  if (forecast_.is_less_work(left())) become_explicit(dt);
}

/// Have many steps of a Rosenbrock method on a small model been of similar size, with more to come?
bool MethodSelector::higher_order_is_cheaper() const {
  constexpr long enough = 60;
  constexpr double many = 100;
  return family_ == &family::rosenbrock && !costs_.family && !couplings_ && steady_.count() >= enough &&
         left() >= many * steady_.mean() && raising_order_pays(state_.plan);
}

bool MethodSelector::may_become_explicit() const {
  const auto& index = state_.plan.variable_index;
  return !needs_implicit_ && !couplings_ && !method_.explicit_choice.empty() && state_.problem->n() > 0 &&
         !(explicit_ && explicit_->costs_more) &&
         std::none_of(index.begin(), index.end(), [](int i) { return i > 1; });
}

void MethodSelector::become_explicit(double dt) {
  past_ = {};
  past_.per_time = forecast_.implicit_work_per_time();
  past_.span = forecast_.time();
  past_.dt = dt;
  past_.is_judged = false;
  method_.tableau = costs_.family ? method_.explicit_choice.back() : explicit_pair_for(method_, state_.plan);
  change(family::explicit_pair, 0, "explicit steps of the size that stability allows would take less work");
}

}  // namespace pendula::integrate
