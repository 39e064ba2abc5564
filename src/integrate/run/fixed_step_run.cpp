#include "integrate/run/fixed_step_run.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "integrate/event/monitor/singularity_monitor.hpp"

namespace pendula::integrate {
namespace {

constexpr double most_steps = 1e12;
constexpr double most_saved = 2.5e8;  // numbers: 2 GB

void check_times(const Plan& plan) {
  const std::vector<double>& times = *plan.times;
  if (times.empty()) throw Error("times is empty; leave it out to save every step");
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i])) throw Error(text("times[", i + 1, "] is not a finite number"));
    if (times[i] < plan.from || times[i] > plan.to) {
      throw Error(text("times[", i + 1, "] = ", rounded(times[i]), " lies outside ", rounded(plan.from),
                       " ≤ t ≤ ", rounded(plan.to)));
    }
    if (i > 0 && times[i] <= times[i - 1]) {
      throw Error(text("times must increase, but times[", i, "] = ", rounded(times[i - 1]), " and times[",
                       i + 1, "] = ", rounded(times[i])));
    }
  }
}

}  // namespace

void check_interval(const Plan& plan) {
  if (!std::isfinite(plan.from) || !std::isfinite(plan.to)) throw Error("from and to must be finite numbers");
  if (plan.to <= plan.from) {
    throw Error(text("to = ", rounded(plan.to), " must be greater than from = ", rounded(plan.from)));
  }
  if (plan.times) check_times(plan);
}

Point checked_start(Point start, const Problem& problem, double from) {
  PENDULA_ASSERT(start.x.size() == problem.n(), "a start with a wrong number of states");
  for (int i = 0; i < problem.n(); ++i)
    if (!std::isfinite(start.x[i])) throw Error(text("the start of ", problem.x_name(i), " is not finite"));
  start.t = from;
  if (start.xdot.size() == 0) start.xdot = Vec::Zero(problem.n());
  if (start.z.size() == 0) start.z = Vec::Zero(problem.m());
  return start;
}

void check_fixed(const Plan& plan, const Problem& problem) {
  check_interval(plan);
  if (!(plan.dt > 0) || !std::isfinite(plan.dt)) {
    throw Error(
        text("dt = ", rounded(plan.dt), "; the step must be a positive number, for example dt = 0.01"));
  }
  const double steps = (plan.to - plan.from) / plan.dt;
  if (steps > most_steps || plan.to - plan.dt == plan.to) {
    throw Error(
        text("dt = ", rounded(plan.dt), " is too small for an interval of ", rounded(plan.to - plan.from)));
  }
  if (plan.times) return;
  const double width = 1 + 2 * problem.n() + problem.m();
  if (steps * width > most_saved) {
    throw Error(text("", rounded(steps, 3), " steps are too many to save; give the times to keep, times = ",
                     "linspace(", rounded(plan.from), ", ", rounded(plan.to), ", 1001), or a larger dt"));
  }
}

void check_adaptive(const Plan& plan) {
  check_interval(plan);
  const auto positive = [](const char* name, double value) {
    if (!(value > 0))
      throw Error(text(name, " = ", rounded(value), "; a tolerance must be a positive number, for example ",
                       name, " = 1e-8"));
  };
  for (double r : plan.tolerances.rtol) {
    if (!std::isfinite(r))
      throw Error(text("rtol = ", r, " must be a positive number, for example rtol = 1e-8"));
    if (!(r >= 0)) positive("rtol", r);
    if (r != 0 && r < 1e-14)
      throw Error(text("rtol = ", rounded(r, 3), " is below what double precision can reach; 1e-13 is about ",
                       "the smallest that makes sense"));
  }
  for (Eigen::Index i = 0; i < plan.tolerances.atol.size(); ++i) {
    const double a = plan.tolerances.atol[i];
    if (!std::isfinite(a))
      throw Error(text("atol = ", a, " must be a positive number, for example atol = 1e-8"));
    if (!(a >= 0)) positive("atol", a);
    if (a == 0 && plan.tolerances.rtol[i] == 0) positive("rtol", 0);
  }
  if (!(plan.dt_max > 0)) throw Error(text("dtmax = ", rounded(plan.dt_max), " must be a positive number"));
  if (!(plan.dt_first >= 0) || !std::isfinite(plan.dt_first))
    throw Error(text("dt0 = ", rounded(plan.dt_first), " must be a positive number"));
  if (plan.most_steps < 1) throw Error(text("max_steps = ", plan.most_steps, " must be at least 1"));
}

namespace {

/// The number of steps: rounding must not add a step of length 1e-16.
long count_steps(const Plan& plan) {
  const double exact = (plan.to - plan.from) / plan.dt;
  const double nearest = std::round(exact);
  const double count =
      std::fabs(exact - nearest) <= 1e-9 * std::max(1.0, nearest) ? nearest : std::ceil(exact);
  return std::max(1L, static_cast<long>(count));
}

/// Between the saved points the method itself continues with steps dt and a shortened last one.
class FixedContinuation : public Continuation {
 public:
  FixedContinuation(std::shared_ptr<RungeKutta> engine, Point start, const Plan& plan)
      : engine_(std::move(engine)), start_(std::move(start)), plan_(plan), dt_(plan.dt) {}

  Point at(const Points& saved, double t) override {
    const double rounding = 4 * std::numeric_limits<double>::epsilon() *
                            std::max(std::fabs(saved.t().front()), std::fabs(saved.t().back()));
    Point here = saved[saved.index_at(t, rounding)], next;
    while (t - here.t > rounding) {
      poll_interrupt();
      const double left = t - here.t;
      engine_->step(here, left < dt_ * (1 + 1e-9) ? left : dt_, next, false);
      std::swap(here, next);
    }
    return here;
  }

  /// The run once more: `times` may have kept a few points of it only.
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

/// Saves mesh points, or the requested times on the way from one mesh point to the next.
class Saver {
 public:
  Saver(Solution& solution, RungeKutta& engine, const Plan& plan)
      : solution_(solution),
        engine_(engine),
        plan_(plan),
        rounding_(4 * std::numeric_limits<double>::epsilon() *
                  std::max(std::fabs(plan.from), std::fabs(plan.to))) {}

  void start(const Point& point) { advance(point, point); }

  void advance(const Point& from, const Point& to) {
    if (!plan_.times) return solution_.save(to);
    for (; next_ < plan_.times->size() && (*plan_.times)[next_] <= to.t + rounding_; ++next_) {
      const double t = (*plan_.times)[next_];
      if (t >= to.t - rounding_) {
        between_ = to;
      } else {
        engine_.step(from, t - from.t, between_, false);
      }
      between_.t = t;  // the time as it was asked for
      solution_.save(between_);
    }
  }

 private:
  Solution& solution_;
  RungeKutta& engine_;
  const Plan& plan_;
  double rounding_;
  std::size_t next_ = 0;
  Point between_;
};

/// A time at which inputs jump, if there is one where a step ends.
double jump_at(const Plan& plan, double t) {
  const double near = 1e-9 * plan.dt;
  const auto next = std::lower_bound(plan.breaks.begin(), plan.breaks.end(), t - near);
  return next != plan.breaks.end() && *next <= t + near ? t - near : std::numeric_limits<double>::infinity();
}

/// Steps until the end or until something stops them; returns the status.
std::string run(Problem& problem, RungeKutta& engine, Point& here, const Plan& plan, Saver& saver,
                GuardWatch& guards) {
  const long steps = count_steps(plan);
  const double last = plan.to - (plan.from + static_cast<double>(steps - 1) * plan.dt);
  const bool even = std::fabs(last - plan.dt) <= 1e-9 * plan.dt * static_cast<double>(steps);
  Point next;
  try {
    for (long k = 1; k <= steps; ++k) {
      poll_interrupt();
      const double jump = jump_at(plan, k < steps ? plan.from + static_cast<double>(k) * plan.dt : plan.to);
      problem.set_limit(jump);
      engine.step(here, k < steps || even ? plan.dt : last, next, true);
      next.t = k < steps ? plan.from + static_cast<double>(k) * plan.dt : plan.to;
      engine.at_time(next.t);
      if (const auto why = guards.after(next)) return *why;
      saver.advance(here, next);
      std::swap(here, next);
      if (plan.progress && k % 16 == 0) plan.progress(here.t, engine.stats());
      problem.set_limit(std::numeric_limits<double>::infinity());
      if (std::isfinite(jump) && !plan.direct) engine.settle(here);  // x′ and z behind the jump
      if (plan.leave && k < steps && plan.leave(here)) return "left";
    }
  } catch (const Interrupted&) {
    return "interrupted";
  } catch (const Failure& failure) {
    return text("stopped at t = ", rounded(here.t, 6), ": ", failure.what(), guards.almost_zero(here));
  }
  return "finished";
}

/// An engine and a start with x′ and z. With `direct`, a model whose x′ and z are determined is still treated
/// as index 1.
std::shared_ptr<RungeKutta> prepare(const ProblemPtr& problem, const TableauPtr& tableau, Point& start,
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
  const std::shared_ptr<RungeKutta> engine = prepare(problem, tableau, start, plan.direct);
  auto solution = std::make_shared<Solution>(problem);
  solution->set_method(tableau->name(), plan.dt);
  solution->set_continuation(std::make_shared<FixedContinuation>(engine, start, plan));
  Saver saver(*solution, *engine, plan);
  saver.start(start);
  GuardWatch guards(problem, plan);
  guards.start(start);
  const std::string status = run(*problem, *engine, start, plan, saver, guards);
  if (guards.cut()) solution->cut(*guards.cut());
  problem->set_limit(std::numeric_limits<double>::infinity());
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  solution->finish(status, engine->stats(), seconds);
  return solution;
}

}  // namespace pendula::integrate
