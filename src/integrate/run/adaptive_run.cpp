#include "integrate/run/adaptive_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <limits>
#include <optional>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/monitor/domain_monitor.hpp"
#include "integrate/event/monitor/peak_monitor.hpp"
#include "integrate/event/monitor/switch_monitor.hpp"
#include "integrate/plan/run_monitors.hpp"
#include "integrate/plan/stall_detector.hpp"
#include "integrate/problem/invariant_zeros.hpp"
#include "integrate/run/event_handler.hpp"
#include "integrate/run/input_breaks.hpp"
#include "integrate/run/method_selector.hpp"
#include "integrate/solution/regrowth.hpp"
#include "integrate/solution/rounding_watch.hpp"
#include "integrate/solution/standstill.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

#if defined(__SSE__)
FlushDenormals::FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040u); }  // FTZ | DAZ
FlushDenormals::~FlushDenormals() { _mm_setcsr(before_); }
#else
FlushDenormals::FlushDenormals() : before_(0) {}
FlushDenormals::~FlushDenormals() = default;
#endif

namespace {

/// Integrates from the last kept point to shortly before the stopping time t, since the step across t may
/// have been long. There are no events in between: those of that step have been found. The remaining distance
/// is halved in turn, so that another stopping reason (plan().stop_when: another choice of constraints is
/// better) is noticed before errors have grown; returns true if there was one.
bool integrate_up_to(AdaptiveState& state, MethodSelector& method, const Point& from, double t) {
  constexpr double rest = 1e-3;    // of the interval; beyond it, equations close to singular amplify errors
  constexpr int most_steps = 100;  // each at most half of the rest
  const double end = t - rest * (t - from.t);
  if (!(end > from.t)) return false;
  const auto& stop_when = state.plan.stop_when;
  double left = t - from.t;
  try {
    state.stepper().start(from, end);
    for (int k = 0; k < most_steps && state.reached < end; ++k) {
      if (state.reached >= t - left) left /= 2;
      state.end = std::min(t - left, end);
      method.step();
      state.view_step();
      state.keep(state.stepper().here(), false);
      if (stop_when && stop_when(state.stepper().here())) return true;
    }
  } catch (const Failure&) {  // close enough
  }
  return false;
}

/// Does the reason say that a factor vanishes, as the reasons of guards do?
bool names_factor(const std::string& reason) {
  return reason.find(" = 0 there, and ") != std::string::npos ||
         reason.find(" almost 0 there; ") != std::string::npos;
}

Failure at_start(double t, const Failure& failure, const char* remedy) {
  return Failure(text("at the start, t = ", rounded(t, 6), ": ", failure.what(), remedy));
}

/// Writes into the solution how often every smooth switch was located, beside its borders.
void report_switches(const SwitchMonitor& switches, Solution& solution) {
  std::vector<BorderInUse> list = solution.borders();
  for (std::size_t i = 0; i < switches.switches().size(); ++i)
    if (const long n = switches.located()[i]; n > 0)
      list.push_back(
          {switches.switches()[i], text("smooth switch, located ", n, n == 1 ? " time" : " times")});
  solution.set_borders(std::move(list));
}

class AdaptiveRun {
 public:
  AdaptiveRun(ProblemPtr problem, const Method& method, const Plan& plan)
      : state_(std::move(problem), plan),
        method_(state_, method),
        modes_(state_, method_),
        monitors_(state_.problem, state_.plan, state_.finder, *state_.history),
        events_(state_, modes_, monitors_),
        breaks_(state_, events_),
        domain_(*state_.problem, state_.plan.guards, state_.plan.tolerances, state_.plan.is_determined(),
                state_.plan.check_singularities),
        switches_(*state_.problem),
        peaks_(*state_.problem, state_.plan.tolerances, state_.plan.is_determined()),
        standstill_(*state_.problem, state_.plan.tolerances, state_.plan.events.list),
        rounding_(*state_.problem, state_.plan.tolerances, state_.plan.variable_index,
                  state_.plan.has_chains),
        regrowth_(invariant_zeros(*state_.problem), state_.plan.tolerances,
                  state_.plan.small_states.repeatable, state_.plan.events.may_jump()),
        is_explicit_(method.family && method.family->is_explicit) {}

  std::shared_ptr<Solution> solution() { return state_.solution; }

  void start(const Point& point) {
    state_.set_step_end(point.t);
    try {
      modes_.initialise(point);
      method_.start(point);
      modes_.begin(point, {});
    } catch (const OpenEquations& failure) {
      throw at_start(
          point.t, failure,
          is_explicit_ ? ", which an explicit method needs; take method = \"radau\" or \"bdf\"" : "");
    } catch (const Failure& failure) {
      throw at_start(point.t, failure, "");
    }
    first_ = stepper().here();
    state_.history->begin(first_);
    state_.writer.begin(first_);
    monitors_.restart(state_.problem);
    monitors_.start(first_);
    domain_.start(first_);
    standstill_.after(first_, plan().to - first_.t);
    state_.stats().regrowth = plan().small_states.followed;
    restart_step_monitors();
    ended_ = events_.settle(nullptr, events_.carried_across(plan().events.sides));
  }

  void go() {
    const std::clock_t begin = std::clock();
    RunOutcome outcome;
    if (ended_) outcome.ending = Ending::event;
    try {
      while (outcome.ending == Ending::running) advance(outcome);
    } catch (const Interrupted&) {
      outcome = {Ending::interrupted, ""};
    } catch (const Failure& failure) {
      outcome = stopped_at(state_.reached, failure.what() + singularity_nearby(almost_vanished));
    }
    if (const auto never = state_.finder.never_finite(); never && outcome.is_complete())
      outcome = stopped_at(state_.reached,
                           text("the condition of an event, ", to_text(plan().events.list[*never].when),
                                ", was not a number anywhere on the solution"));
    state_.writer.release();
    state_.problem->set_limit(std::numeric_limits<double>::infinity());
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    modes_.report();
    report_switches(switches_, *state_.solution);
    state_.solution->set_rounding(rounding_.remark(*state_.problem, stepper().here()));
    try {
      if (outcome.ending == Ending::stopped && plan().continuations)
        outcome.message += plan().continuations(point_near(outcome.t), names_factor(outcome.message));
    } catch (const Interrupted&) {  // keeps the solution so far, without continuations
    }
    if (state_.solution->not_unique().empty()) state_.solution->set_not_unique(domain_.not_unique());
    state_.stats().rest = standstill_.rest(stepper().here());
    state_.solution->finish(std::move(outcome), state_.stats(), seconds);
  }

 private:
  Stepper& stepper() { return state_.stepper(); }
  const Plan& plan() const { return state_.plan; }

  /// One step including its events and monitors; sets the outcome when the run is over.
  void advance(RunOutcome& outcome) {
    poll_interrupt();
    check_progress();
    state_.view.record = nullptr;
    if (modes_.slide_where_steps_are_tiny()) events_.begin_again(Point(stepper().here()), {});
    step();
    if (breaks_.has_repeated_step()) return;
    if (is_rejected(outcome)) return;
    state_.view_step();
    if (modes_.has_missed_excursion() && events_.repeated_shorter()) return restart_step_monitors();
    if (events_.after_step(outcome)) return restart_step_monitors();
    if (plan().modes > 0) modes_.require_way_on(stepper().before());
    const bool done = stepper().here().t >= plan().to, at_break = stepper().here().t >= state_.end;
    state_.keep(stepper().here(), at_break && (!done || breaks_.are_at_end()));
    standstill_.after(stepper().here(), plan().to - stepper().here().t);
    if ((plan().has_chains || !stepper().is_explicit()) && rounding_.wants(state_.stats().steps))
      rounding_.after(*state_.problem, stepper().before(), stepper().here(), state_.stats().steps);
    if (const auto stop = monitors_.after({stepper().before(), stepper().here(), done, state_.stats()}))
      return stop_at(*stop, outcome);
    if (regrowth_.ends_run(stepper().before(), stepper().here(), state_.stats())) {
      outcome.ending = Ending::regrowth;
    } else if (done) {
      outcome.ending = Ending::finished;
      if (breaks_.are_at_end()) breaks_.arrive();
    } else if (at_break) {
      if (breaks_.pass()) outcome.ending = Ending::event;
    } else {
      if (plan().modes > 0 && modes_.differ()) events_.begin_again(Point(stepper().here()), {});
      if (plan().stop_when && plan().stop_when(stepper().here()))
        outcome.ending = Ending::stop_when;
      else
        method_.change_method_if_cheaper();
    }
  }

  void restart_step_monitors() {
    for (StepMonitor* monitor : step_monitors()) monitor->restart(state_.problem, stepper().here());
  }

  /// A step that fails with frozen branches may succeed with the original ones, since a frozen branch may be
  /// singular beyond its border. Near √|s| sign(s) = 0 it may fail because the solution stays at s = 0 and
  /// has to slide.
  void step() {
    try {
      return method_.step();
    } catch (const Failure&) {
      const Point here = stepper().here();
      if (breaks_.has_jumped_to_next(here)) return method_.step();
      const bool unfrozen = plan().modes > 0 && modes_.unfreeze_all(here);
      if (!unfrozen && !modes_.slide_where_crossed(here, true)) throw;
      events_.begin_again(here, {});
    }
    method_.step();
  }

  void check_progress() {
    const Stats& stats = state_.stats();
    if (stats.steps >= plan().most_steps)
      throw Failure(text("max_steps = ", plan().most_steps, " steps were not enough",
                         stepper().is_stiff() ? ". They are limited by stability: the equations are stiff, "
                                                "take method = \"radau\" or \"bdf\""
                                              : ""));
    constexpr double vanished = 1e-6, almost = 0.01;  // relative to the value at the start
    constexpr double tiny = 1e-7;                     // step size relative to the time since the start
    const bool guarded = !plan().guards.empty() || !plan().blocks.empty();
    const double t = stepper().here().t;
    if (guarded && stall_.is_stalled(t, stats, state_.interval()) &&
        !singularity_nearby(stepper().next_dt() < tiny * (t - plan().from) ? almost : vanished).empty())
      throw Failure(text("no progress in the last ", StallDetector::every, " steps (step size ",
                         rounded(stepper().next_dt(), 2), ")"));
    constexpr int often = 8;  // steps
    if (!plan().progress || ++since_progress_ < often) return;
    since_progress_ = 0;
    plan().progress(state_.reached, stats);
  }

  /// Ends the run at the request of a monitor and discards the solution after that time.
  void stop_at(const Stop& stop, RunOutcome& outcome) {
    state_.reached = state_.history->has_forgotten() ? stop.known : state_.history->cut(stop.t);
    state_.solution->cut(state_.reached);
    state_.writer.rewind(state_.reached);
    outcome = stopped_at(stop, 6);
    const bool in_last_step = state_.reached == stepper().before().t;
    if (!in_last_step && state_.history->has_forgotten()) return;
    if (in_last_step) stop_point_ = point_near(stop.t);
    const Point from = in_last_step ? stepper().before() : state_.solution->at(state_.reached);
    if (integrate_up_to(state_, method_, from, stop.t)) outcome = {Ending::stop_when, ""};
  }

  /// In the order in which they are asked.
  std::array<StepMonitor*, 4> step_monitors() { return {&domain_, &switches_, &peaks_, &regrowth_}; }

  /// Has a monitor rejected the step? Then it has been taken back, or the run is over.
  bool is_rejected(RunOutcome& outcome) {
    const auto monitors = step_monitors();
    for (auto at = monitors.begin(); at != monitors.end(); ++at) {
      const auto rejection = (*at)->after(state_.problem, stepper().before(), stepper().here());
      if (!rejection) continue;
      const double t = stepper().before().t;
      const bool repeated = is_repeated(*rejection);
      if (repeated || !rejection->reason.empty()) {
        if (!repeated) outcome = stopped_at(t, rejection->reason);
        // the others are still at the beginning of the step
        for (auto before = monitors.begin(); before != at; ++before)
          (*before)->restart(state_.problem, stepper().here());
        return true;
      }
      state_.stats().errors += rejection->error;
      (*at)->restart(state_.problem, stepper().here());
    }
    return false;
  }
  bool is_repeated(const Rejection& rejection) {
    if (rejection.is_tolerated) return false;
    return rejection.until ? events_.repeated_until(*rejection.until) : events_.repeated_shorter();
  }

  /// The solution at the stopping time, extrapolated from the last step if necessary.
  Point point_near(double t) {
    if (stop_point_) return *stop_point_;
    try {
      return state_.solution->at(t);
    } catch (const UserFacing&) {  // the run ended before t
    }
    const Point &from = stepper().before(), &to = stepper().here();
    if (!(to.t > from.t) || from.x.size() != to.x.size()) return to;
    Point point;
    hermite(from, to, std::clamp((t - from.t) / (to.t - from.t), 0.0, 2.0), point);
    return point;
  }

  /// After a failure: the quantity that the equations require and that has almost vanished at the last point.
  std::string singularity_nearby(double almost) {
    if (plan().guards.empty() && plan().blocks.empty()) return domain_.almost_outside(stepper().here());
    SingularityMonitor divisors(state_.problem, plan().guards);
    RankMonitor ranks(state_.problem, plan().blocks, default_rtol, plan().sizes);
    divisors.start(first_);
    ranks.start(first_);
    const bool back = state_.solution->size() > 0 && state_.reached < stepper().here().t;
    const Point& point = back ? stepper().before() : stepper().here();
    const std::string found = near_singularity(divisors, ranks, point, almost);
    return found.empty() ? domain_.almost_outside(point) : found;
  }

  AdaptiveState state_;
  MethodSelector method_;
  ModeTracker modes_;
  AdaptiveStepMonitors monitors_;
  EventHandler events_;
  InputBreaks breaks_;
  DomainMonitor domain_;
  SwitchMonitor switches_;
  PeakMonitor peaks_;
  Standstill standstill_;
  RoundingWatch rounding_;
  RegrowthWatch regrowth_;
  StallDetector stall_;
  const bool is_explicit_;  ///< of the requested method
  bool ended_ = false;      ///< by an event at the start
  Point first_;
  std::optional<Point> stop_point_;  ///< where the run has stopped, by interpolation in the step across it
  int since_progress_ = 0;
};

}  // namespace

SolutionPtr integrate_adaptive(ProblemPtr problem, const Method& method, Point start, const Plan& plan,
                               const std::function<void(SolutionPtr)>& watch) {
  check_adaptive(plan);
  start = checked_start(std::move(start), *problem, plan.from);
  problem->accelerate();
  const FlushDenormals guard;
  AdaptiveRun run(problem, method, plan);
  if (watch) watch(run.solution());
  run.start(start);
  run.go();
  return run.solution();
}

}  // namespace pendula::integrate
