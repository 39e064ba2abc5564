#include "integrate/event/monitor/tangency_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/search/golden_section.hpp"
#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

TangencyMonitor::TangencyMonitor(const ProblemPtr& problem, const std::vector<Event>& events,
                                 const EventFinder& finder, const Tolerances& tolerances, double interval)
    : given_(problem),
      problem_(problem),
      events_(events),
      finder_(finder),
      tolerances_(tolerances),
      interval_(interval) {
  empty_ = std::none_of(events.begin(), events.end(),
                        [](const Event& event) { return !event.termination_reason.empty(); });
  const std::vector<Expr>& z = problem->model().z;
  for (const Event& event : events) {
    const std::vector<Expr> inside = leaves({&event.when, 1});
    with_z_.push_back(!event.termination_reason.empty() &&
                      std::any_of(inside.begin(), inside.end(),
                                  [&](Expr leaf) { return std::find(z.begin(), z.end(), leaf) != z.end(); }));
    any_with_z_ = any_with_z_ || with_z_.back();
  }
}

void TangencyMonitor::forget() {
  seen_.clear();
  inside_.clear();
  begin_.reset();
  has_previous_ = false;
}

void TangencyMonitor::restart(const ProblemPtr& problem) {
  forget();
  if (given_ == problem) {
    if (solver_) problem_->take_parameters(*problem);
    return;
  }
  given_ = problem_ = problem;
  solver_.reset();
  conditions_.clear();
  gradients_.clear();
}

std::optional<Stop> TangencyMonitor::after(const MonitoredStep& step) {
  if (empty_) return {};
  constexpr double near = 0.01;  // relative to the largest value so far; larger minima are not considered
  const std::vector<double>& g = finder_.values();
  std::optional<Stop> stop;
  known_count_ = 0;
  if (const auto gone = finder_.vanished(g))  // a step that happens to end at the zero
    return Stop{step.here.t, events_[*gone].termination_reason, step.before.t};
  const bool fresh = seen_.size() != g.size();
  if (fresh) seen_.assign(g.size(), {});
  for (std::size_t i = 0; i < g.size(); ++i) {
    const std::string& reason = events_[i].termination_reason;
    if (reason.empty()) continue;
    Values& seen = seen_[i];
    const double size = std::fabs(seen.last);
    bool turned = !fresh && g[i] * seen.last > 0 && size <= std::fabs(seen.before) && size < std::fabs(g[i]);
    // z of a mesh point is accurate to the tolerances only
    if (turned && with_z_[i])
      turned = size_between(i, step.before, step.here, 0) <= size_between(i, step.before, step.here, 1);
    if (turned && !stop && with_z_[i] && has_previous_)
      if (const auto t = time_of_zero(i, step)) stop = Stop{*t, reason, previous_.t};
    if (turned && !stop && size <= near * seen.largest && can_vanish(i, step.before))
      stop = Stop{step.before.t,
                  text("within the tolerances (", rounded(size, 1), ") ", reason,
                       "; if the solution only comes near, ask for smaller tolerances or go on with ",
                       "guards = false"),
                  step.before.t};
    if (with_z_[i] && !stop)
      if (const auto t = zero_inside(i, step, fresh ? INFINITY : size))
        stop = Stop{*t, reason, *t < step.before.t ? previous_.t : step.before.t};
    const bool first = fresh && with_z_[i];  // the first step may end where branches cross
    seen.before = first ? size_between(i, step.before, step.here, 0) : fresh ? 0 : seen.last;
    seen.last = g[i];
    seen.largest = std::max(seen.largest, std::fabs(g[i]));
  }
  if (any_with_z_) previous_ = step.before;
  has_previous_ = any_with_z_;
  return stop;
}

/// |g| inside a step; 0 where the equations have no solution.
double TangencyMonitor::size_between(std::size_t which, const Point& from, const Point& to, double share) {
  const Point* at = inside(from, to, share);
  return at ? std::fabs(value_at(which, *at)) : 0;
}

/// x by Hermite interpolation, z from the equations.
const Point* TangencyMonitor::inside(const Point& from, const Point& to, double share) {
  for (std::size_t k = 0; k < known_count_; ++k)
    if (const Inside& known = known_[k]; known.share == share && known.from == from.t && known.to == to.t)
      return known.solved ? &known.at : nullptr;
  if (!solver_) {
    problem_ = std::make_shared<Problem>(*given_);
    solver_ = std::make_unique<RhsSolver>(problem_, ignored_);
  }
  if (known_count_ == known_.size()) known_.emplace_back();
  Inside& added = known_[known_count_++];
  added.from = from.t;
  added.to = to.t;
  added.share = share;
  Point& p = added.at;
  hermite(from, to, share, p);
  try {
    solver_->require(p.t, p.x.data(), p.xdot.data(), p.z.data());
    added.solved = true;
  } catch (const Failure&) {
    added.solved = false;
  }
  return added.solved ? &p : nullptr;
}

double TangencyMonitor::value_at(std::size_t which, const Point& p) {
  if (conditions_.empty()) conditions_.resize(events_.size());
  if (conditions_[which].outputs() == 0)
    conditions_[which] = codegen::Kernel(std::vector{events_[which].when}, problem_->arguments());
  problem_->set_point(p.t, p.x.data(), p.xdot.data(), p.z.data());
  double g = 0;
  conditions_[which](problem_->values().data(), &g);
  return g;
}

/// Golden section search in the last two steps.
std::optional<double> TangencyMonitor::time_of_zero(std::size_t which, const MonitoredStep& step) {
  if (const auto t = least_between(which, previous_, step.before, 0, 1)) return t;
  return least_between(which, step.before, step.here, 0, 1);
}

/// Samples |g| inside every step, more densely in steps that are long relative to the time so far, and once
/// shortly before the end of the run. Around a sample smaller than both neighbours the minimum is located.
/// before: |g| at the beginning of the step, infinite if the last step is unknown.
std::optional<double> TangencyMonitor::zero_inside(std::size_t which, const MonitoredStep& step,
                                                   double before) {
  constexpr double almost_end = 0.999, long_step = 0.1;  // relative to the time so far
  const Point &from = step.before, &to = step.here;
  if (!begin_) begin_ = from.t;
  const int parts = to.t - from.t > long_step * (to.t - *begin_) ? 12 : 3;
  const auto size = [&](int k) { return size_between(which, from, to, static_cast<double>(k) / parts); };
  const auto share = [&](int k) { return static_cast<double>(k) / parts; };
  inside_.resize(events_.size(), {INFINITY, 0});
  const auto [last, last_share] = inside_[which];
  double left = last, middle = std::isfinite(before) ? before : size(0);
  std::optional<double> t;
  for (int k = 0; k < parts; ++k) {  // middle is |g| at share(k)
    const double right = k + 1 < parts ? size(k + 1) : std::fabs(finder_.values()[which]);
    if (!t && k == 0) t = near_beginning(which, step, share(1), right, middle);
    if (!t && middle <= left && middle < right) {
      if (k == 0 && has_previous_) t = least_between(which, previous_, from, last_share, 1);
      if (!t) t = least_between(which, from, to, share(std::max(k - 1, 0)), share(k + 1));
    }
    left = std::exchange(middle, right);
  }
  inside_[which] = {left, share(parts - 1)};
  if (!t && step.last && middle < left && size_between(which, from, to, almost_end) < middle)
    t = least_between(which, from, to, share(parts - 1), 1);
  return t;
}

/// Searches just after the beginning of the step, where |g| = first: a step may be 10¹⁰ times as long as the
/// distance to a crossing. beyond: |g| at this share of the step.
std::optional<double> TangencyMonitor::near_beginning(std::size_t which, const MonitoredStep& step,
                                                      double share, double beyond, double first) {
  constexpr double closer = 0.3, closest = 1e-15, flat = 0.05;
  double right = beyond, at = closer * share;
  if (!(first < closer * right)) return {};
  double middle = size_between(which, step.before, step.here, at);
  while (at > closest) {
    const double left = size_between(which, step.before, step.here, closer * at);
    if (middle < left && middle < right)
      if (const auto t = least_between(which, step.before, step.here, closer * at, at / closer)) return t;
    if (std::fabs(left - first) <= flat * first && std::fabs(middle - first) <= flat * first) return {};
    right = std::exchange(middle, left);
    at *= closer;
  }
  return {};
}

/// Golden section search in a part of a step, until |g| is constant on the remaining interval. (Towards a
/// zero it falls at least like a square root, to 0.73 in each section.) Values count as 0 below 10⁻⁶ of those
/// at the ends, below 10⁻⁹ of the change of |g| at this rate over the run, or below rounding.
std::optional<double> TangencyMonitor::least_between(std::size_t which, const Point& from, const Point& to,
                                                     double low, double high) {
  constexpr double closest = 1e-6, most = 1e-2, epsilon = 2.2e-16, flat = 0.99;
  constexpr int first_sections = 3;
  const auto size = [&](double share) { return size_between(which, from, to, share); };
  // in a step hardly longer than the rounding of t, |g| is resolved only to its change in that rounding
  const double rounding = 16 * epsilon * std::max(std::fabs(from.t), std::fabs(to.t)) / (to.t - from.t);
  const double least = std::clamp(1e-9 * interval_ / ((high - low) * (to.t - from.t)), closest, 1e-3);
  const double zero = std::clamp(rounding, least, most);
  double ends = 0;
  const auto is_enough = [&](const GoldenSection& s, int k) {
    const double at_ends = std::max(s.at_low, s.at_high);
    if (k == 0) ends = at_ends;
    return !(s.least() > 0) || (k >= first_sections && s.least() > flat * at_ends);
  };
  const GoldenSection found = golden_section(size, low, high, 50, is_enough);
  const double share = found.best(), beside = 1e-3 * (high - low);
  const double around = std::max(size(share - beside), size(share + beside));  // a failure alone is no proof
  if (found.least() <= zero * ends && around > 0 && around <= 0.1 * ends)
    return from.t + share * (to.t - from.t);
  return {};
}

/// Can an admissible error of every yⱼ in (x, z), some tolerances atolⱼ + rtolⱼ |yⱼ|, make g zero? The
/// linearisation of g must allow it, and g itself must turn or change its sign on that line: exponentials and
/// sums of positive terms fall without reaching 0.
bool TangencyMonitor::can_vanish(std::size_t which, const Point& point) {
  constexpr double within = 10;  // tolerances, since the errors of steps accumulate
  constexpr int parts = 16;
  const auto& model = problem_->model();
  if (gradients_.empty()) gradients_.resize(events_.size());
  if (gradients_[which].outputs() == 0) {
    std::vector<Expr> unknowns = model.x;
    unknowns.insert(unknowns.end(), model.z.begin(), model.z.end());
    gradients_[which] = codegen::Kernel(gradient(events_[which].when, unknowns), problem_->arguments());
  }
  problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  std::vector<double> slopes(model.x.size() + model.z.size());
  gradients_[which](problem_->values().data(), slopes.data());
  const double begin = value_at(which, point);
  double change = 0;
  Point end = point;
  for (std::size_t j = 0; j < slopes.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    double& y = k < end.x.size() ? end.x[k] : end.z[k - end.x.size()];
    const double off = within * (tolerances_.atol[k] + tolerances_.rtol[k] * std::fabs(y));
    change += std::fabs(slopes[j]) * off;
    if (slopes[j] != 0) y += slopes[j] * begin > 0 ? -off : off;
  }
  if (!(std::fabs(begin) <= change)) return false;
  double last = std::fabs(begin);
  Point there = point;
  for (int k = 1; k <= parts; ++k) {
    const double share = static_cast<double>(k) / parts;
    there.x = point.x + share * (end.x - point.x);
    there.z = point.z + share * (end.z - point.z);
    const double g = value_at(which, there);
    if (!(g * begin > 0) || std::fabs(g) > last) return true;
    last = std::fabs(g);
  }
  return false;
}

}  // namespace pendula::integrate
