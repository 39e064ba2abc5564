#include "integrate/plan/plan.hpp"

#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::integrate {
namespace {

constexpr double most_steps = 1e12;   // of one length: beyond it days
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
  const double dt = plan.dt.value_or(0);
  if (!(dt > 0) || !std::isfinite(dt))
    throw Error(text("dt = ", rounded(dt), "; the step must be a positive number, for example dt = 0.01"));
  const double steps = (plan.to - plan.from) / dt;
  if (steps > most_steps || plan.to - dt == plan.to)
    throw Error(
        text("dt = ", rounded(dt), " is too small for an interval of ", rounded(plan.to - plan.from)));
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

}  // namespace pendula::integrate
