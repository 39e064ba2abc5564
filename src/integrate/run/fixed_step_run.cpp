#include "integrate/run/fixed_step_run.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <utility>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "integrate/plan/run_monitors.hpp"
#include "integrate/solution/output_writer.hpp"

namespace pendula::integrate {
namespace {

/// The number of steps; rounding must not add a step of length 1e-16.
long count_steps(const Plan& plan) {
  const double exact = (plan.to - plan.from) / *plan.dt;
  const double nearest = std::round(exact);
  const double count =
      std::fabs(exact - nearest) <= dt_rounding * std::max(1.0, nearest) ? nearest : std::ceil(exact);
  return std::max(1L, static_cast<long>(count));
}

/// Continues from the saved points with the method itself: steps of size dt and a shorter last one.
class FixedContinuation : public Continuation {
 public:
  FixedContinuation(std::shared_ptr<RungeKutta> engine, Point start, const Plan& plan)
      : engine_(std::move(engine)), start_(std::move(start)), plan_(plan), dt_(*plan.dt) {}

  Point at(const Points& saved, double t) override {
    const double rounding = 4 * std::numeric_limits<double>::epsilon() *
                            std::max(std::fabs(saved.t().front()), std::fabs(saved.t().back()));
    Point here = saved[saved.index_at(t, rounding)], next;
    while (t - here.t > rounding) {
      poll_interrupt();
      const double left = t - here.t;
      engine_->step(here, left < dt_ * (1 + dt_rounding) ? left : dt_, next, false);
      std::swap(here, next);
    }
    return here;
  }

  /// Repeats the run, since `times` may have kept few of its points.
  std::vector<DiscreteStep> steps() override {
    const std::string remedy = "; integrate with sensitivities = { … }";
    if (plan_.direct) throw Error("the adjoint needs a model of index 0 or 1, not direct = true" + remedy);
    if (!plan_.breaks.empty())
      throw Error("with samples as inputs the adjoint needs chosen steps: leave dt out" + remedy);
    const long count = count_steps(plan_);
    const auto tableau = std::make_shared<const Tableau>(engine_->tableau());
    std::vector<DiscreteStep> result;
    Point here = start_, next;
    for (long k = 1; k <= count; ++k) {
      poll_interrupt();
      const double end = k < count ? plan_.from + static_cast<double>(k) * dt_ : plan_.to;
      result.push_back({here, end, tableau, {}});
      if (k == count) break;
      engine_->step(here, end - here.t, next, false);
      next.t = end;
      std::swap(here, next);
    }
    return result;
  }

 private:
  std::shared_ptr<RungeKutta> engine_;
  Point start_;
  Plan plan_;
  double dt_;
};

/// A time just before a jump of the inputs at t; infinite if there is none.
double jump_at(const Plan& plan, double t) {
  const double near = dt_rounding * *plan.dt;
  const auto next = std::lower_bound(plan.breaks.begin(), plan.breaks.end(), t - near);
  return next != plan.breaks.end() && *next <= t + near ? t - near : std::numeric_limits<double>::infinity();
}

/// Computes x′ and z after a jump of the inputs; they are the values of the solution at the time of the jump.
/// At the end of the run a failure keeps the values before it.
void settle_behind(RungeKutta& engine, Point& point, bool at_end) {
  const Point before = point;
  try {
    engine.settle(point);
  } catch (const Failure&) {
    if (!at_end) throw;
    point = before;
  }
}

/// Steps until the end of the interval or until a monitor or failure ends the run.
RunOutcome run(Problem& problem, RungeKutta& engine, Point& here, const Plan& plan, OutputWriter& writer,
               Solution& solution, FixedStepMonitors& monitors) {
  const double dt = *plan.dt;
  const long steps = count_steps(plan);
  const auto mesh = [&](long k) { return k < steps ? plan.from + static_cast<double>(k) * dt : plan.to; };
  const double last = plan.to - mesh(steps - 1);
  const bool even = std::fabs(last - dt) <= dt_rounding * dt * static_cast<double>(steps);
  Point next;
  try {
    for (long k = 1; k <= steps; ++k) {
      poll_interrupt();
      const double jump = jump_at(plan, mesh(k));
      problem.set_limit(jump);
      engine.step(here, k < steps || even ? dt : last, next, true);
      next.t = mesh(k);
      engine.at_time(next.t);
      if (const auto stop = monitors.after(here, next)) {
        solution.cut(stop->t);
        return stopped_at(*stop);
      }
      problem.set_limit(std::numeric_limits<double>::infinity());
      if (std::isfinite(jump) && !plan.direct) settle_behind(engine, next, k == steps);
      writer.step(next, false, [&](double t, Point& out) { engine.step(here, t - here.t, out, false); });
      std::swap(here, next);
      if (plan.progress && k % 16 == 0) plan.progress(here.t, engine.stats());
      if (plan.stop_when && k < steps && plan.stop_when(here)) return {Ending::stop_when, ""};
    }
  } catch (const Interrupted&) {
    return {Ending::interrupted, ""};
  } catch (const Failure& failure) {
    return stopped_at(here.t, failure.what() + monitors.near_singularity(here));
  }
  return {Ending::finished, ""};
}

/// Makes an engine and completes the start by x′ and z. A model that determines x′ and z is treated as index
/// 1 even if `direct` is set.
std::shared_ptr<RungeKutta> make_engine(const ProblemPtr& problem, const TableauPtr& tableau, Point& start,
                                        bool direct) {
  auto engine = std::make_shared<RungeKutta>(problem, tableau);
  try {
    engine->settle(start);
    engine->require_determined(start);
    return engine;
  } catch (const Failure& failure) {
    if (!direct) throw Failure(text("at the start, t = ", rounded(start.t, 6), ": ", failure.what()));
  }
  return std::make_shared<RungeKutta>(problem, tableau, true);
}

}  // namespace

SolutionPtr integrate(ProblemPtr problem, TableauPtr tableau, Point start, const Plan& plan) {
  check_fixed(plan, *problem);
  start = checked_start(std::move(start), *problem, plan.from);
  const std::clock_t begin = std::clock();
  const std::shared_ptr<RungeKutta> engine = make_engine(problem, tableau, start, plan.direct);
  auto solution = std::make_shared<Solution>(problem);
  solution->set_method(tableau->name(), *plan.dt);
  solution->set_continuation(std::make_shared<FixedContinuation>(engine, start, plan));
  OutputWriter writer(*solution, plan.times, plan.from, plan.to);
  writer.begin(start);
  FixedStepMonitors monitors(problem, plan);
  monitors.start(start);
  RunOutcome outcome = run(*problem, *engine, start, plan, writer, *solution, monitors);
  problem->set_limit(std::numeric_limits<double>::infinity());
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  solution->finish(std::move(outcome), engine->stats(), seconds);
  return solution;
}

}  // namespace pendula::integrate
