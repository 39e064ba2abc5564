#include "integrate/run/adaptive_state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pendula::integrate {

static Plan with_tolerances(Plan plan, const Problem& problem) {
  if (plan.tolerances.rtol.size() == 0)
    plan.tolerances = Tolerances::uniform(problem.n() + problem.m(), default_rtol, 1e-9);
  return plan;
}

/// Names the unknowns of index 3 and higher. They contain an error δ of a constraint as δ/h² or worse, and
/// are excluded from the error test (Hairer & Wanner II, §VII.4).
static std::string untested(const Problem& problem, const std::vector<int>& indices) {
  constexpr int first = 3;          // index: HW II, §VII.4 tests what is of index 2 after scaling by h
  constexpr std::size_t shown = 3;  // names
  std::vector<std::string> names;
  int highest = 0, lowest = std::numeric_limits<int>::max();
  for (std::size_t k = 0; k < indices.size(); ++k) {
    if (indices[k] < first) continue;
    const int i = static_cast<int>(k), n = problem.n();
    if (i < n ? i < problem.visible_n() : i - n < problem.visible_m())
      names.push_back(i < n ? problem.x_name(i) : problem.z_name(i - n));
    highest = std::max(highest, indices[k]);
    lowest = std::min(lowest, indices[k]);
  }
  if (names.empty()) return "";
  const std::string more = names.size() > shown ? text(" and ", names.size() - shown, " more") : "";
  names.resize(std::min(names.size(), shown));
  return text("no step tests the error of ", join(names, ", "), more, ", of index ",
              lowest < highest ? "up to " : "", highest, ": it can be that of the constraints divided by h^",
              highest - 1,
              ". sol:check() measures it; sys:reduce():integrate{…} has it within the tolerance");
}

AdaptiveState::AdaptiveState(ProblemPtr given, const Plan& asked)
    : problem(std::move(given)),
      plan(with_tolerances(asked, *problem)),
      history(std::make_shared<StepHistory>(problem->n(), problem->m())),
      solution(std::make_shared<Solution>(problem)),
      writer(*solution, plan.times, plan.from, plan.to),
      finder(problem, plan.events.list, &history->stats) {
  if (plan.times) history->may_forget();
  solution->set_continuation(history);
  solution->set_untested(untested(*problem, plan.variable_index));
  finder.set_interval(plan.from, plan.to);
}

void AdaptiveState::use(ProblemPtr other) {
  problem = std::move(other);
  problem->accelerate();
  problem->set_limit(limit_);
}

void AdaptiveState::limit(double t) {
  limit_ = t;
  problem->set_limit(t);
  finder.set_limit(t);
}

void AdaptiveState::set_step_end(double t) {
  const auto next = std::upper_bound(plan.breaks.begin(), plan.breaks.end(), t);
  const bool any = next != plan.breaks.end();
  end = any && *next < plan.to ? *next : plan.to;
  limit(any ? *next : std::numeric_limits<double>::infinity());
}

void AdaptiveState::view_step() {
  record_.resize(stepper().record_size());
  stepper().record(record_.data());
  view.record = record_.data();
  if (finder.empty() && !writer.wants(stepper().here().t)) return;
  view.from = stepper().before();
  view.to = stepper().here();
}

void AdaptiveState::keep(const Point& last, bool about_to_jump) {
  history->step_to(last, record_);
  writer.step(last, about_to_jump, [&](double t, Point& out) { stepper().look(view, t, Detail::full, out); });
  reached = last.t;
}

void AdaptiveState::go_on(const Point& before) {
  writer.go_on(stepper().here(), jumps(before, stepper().here()));
}

bool AdaptiveState::jumps(const Point& before, const Point& after) const {
  constexpr double tolerances_of_z = 10;  // the errors of z on both sides, some tolerances each
  constexpr double share_of_slope = 1e-3, slopes = 1e-6;  // relative to x′, and to the largest of all x′
  const Tolerances& tol = plan.tolerances;
  for (Eigen::Index i = 0, n = before.x.size(); i < before.z.size(); ++i) {
    const double size = std::max(std::fabs(before.z[i]), std::fabs(after.z[i]));
    if (std::fabs(after.z[i] - before.z[i]) > tolerances_of_z * (tol.atol[n + i] + tol.rtol[n + i] * size))
      return true;
  }
  if (before.xdot.size() == 0) return false;
  const double floor =
      slopes * std::max(before.xdot.lpNorm<Eigen::Infinity>(), after.xdot.lpNorm<Eigen::Infinity>());
  for (Eigen::Index i = 0; i < before.xdot.size(); ++i) {
    const double size = std::max(std::fabs(before.xdot[i]), std::fabs(after.xdot[i]));
    if (std::fabs(after.xdot[i] - before.xdot[i]) > share_of_slope * size + floor) return true;
  }
  return false;
}

Point AdaptiveState::inside(double t, Detail detail) {
  Point point;
  point.xdot = view.to.xdot;
  point.z = view.to.z;
  stepper().interpolate(view, t, detail, point);
  return point;
}

}  // namespace pendula::integrate
