// The conditions of events at points inside a step (docs/derivations.md#events).
#include <algorithm>
#include <cmath>

#include "integrate/event/events.hpp"
#include "integrate/problem/rhs_solver.hpp"

namespace pendula::integrate {

void EventFinder::sample(Stepper& stepper, const StepView& step, double t, Detail detail, Sample& out) {
  if (t >= step.to.t) return evaluate(step.to, out);
  if (!wants_.solution) return evaluate(step.to, t, out);
  if (detail == Detail::state && conditions_->needs_derivatives) detail = Detail::full;
  const bool exact = interpolate(stepper, step, t, detail);
  evaluate(point_, out);
  out.exact = exact;
}

/// The solution inside a step, as point_. False if it is coarse: as asked for, or where the equations have no
/// value, as sin(s)/s on a border s = 0.
bool EventFinder::interpolate(Stepper& stepper, const StepView& step, double t, Detail detail) {
  point_.xdot = step.to.xdot;
  point_.z = step.to.z;
  if (detail != Detail::coarse) try {
      stepper.interpolate(step, t, detail, point_);
      return true;
    } catch (const UndefinedEquations&) {
    }
  return interpolate_coarsely(stepper, step, t);
}

/// x′ and z of the equations at a point, to a relative accuracy, on the branch of the values there. Without
/// the stages of a step: a look costs what solving for them costs. False where that fails, or might end on
/// another branch.
bool EventFinder::solve_at(const Stepper& stepper, Point& at, double accuracy) {
  const Problem& now = stepper.problem();
  if (!along_.problem || along_.problem->shared_model() != now.shared_model()) {
    if (!along_.stats) along_.own_stats = std::make_shared<Stats>();
    along_.problem = std::make_shared<Problem>(now);
    Stats& stats = along_.stats ? *along_.stats : *along_.own_stats;
    along_.equations = std::make_shared<RhsSolver>(along_.problem, stats);
  } else if (along_.of != &now || along_.version != now.version()) {
    along_.problem->take_parameters(now);
  }
  along_.of = &now;
  along_.version = now.version();
  return along_.equations->stage(at.t, at.x.data(), at.xdot.data(), at.z.data(), accuracy);
}

/// Where the cubic is as good as the solution: its error falls with the square of the distance from the
/// start. x′ and z solve the equations to rounding.
void EventFinder::sample_near_start(Stepper& stepper, const StepView& step, double t, Sample& out) {
  if (stepper.is_determined()) {
    point_.xdot = step.from.xdot;
    point_.z = step.from.z;
    stepper.interpolate(step, t, Detail::coarse, point_);
    point_.xdot = step.from.xdot;
    point_.z = step.from.z;
    if (solve_at(stepper, point_, 0)) return evaluate(point_, out);
  }
  sample(stepper, step, t, Detail::full, out);
}

/// x′ and z to begin with inside a step: the parabola through the last look, with its slope, and the end of
/// the step that lies behind.
void EventFinder::predict(const StepView& step, Point& at) const {
  if (!(last_solved_.at.t >= step.from.t && last_solved_.at.t <= step.to.t) || last_solved_.at.t == at.t)
    return;
  const Point& end = at.t > last_solved_.at.t ? step.to : step.from;
  const double s = at.t - last_solved_.at.t, length = end.t - last_solved_.at.t;
  const auto between = [&](const Vec& y, const Vec& rate, const Vec& there, Vec& out) {
    out = y + s * rate + (s / length) * (s / length) * (there - y - length * rate);
  };
  between(last_solved_.at.xdot, last_solved_.rate.xdot, end.xdot, at.xdot);
  between(last_solved_.at.z, last_solved_.rate.z, end.z, at.z);
}

/// dg/dt of the conditions that contain x′ or z, at a point that has been sampled or is an end of the step:
/// x′ and z are solved for there and a little apart on the tangent, x + δ x′ at t + δ, so that z′ and x″ are
/// those of the implicit function theorem. False where x′ and z do not follow from x, or not so easily.
bool EventFinder::differentiate(Stepper& stepper, const StepView& step, double t, Sample& out) {
  constexpr double of_step = 1.0 / 4096;       // far more than rounding, far less than the step
  constexpr double accuracy = of_step * 1e-3;  // of what z changes in the step: few iterations
  if (!stepper.is_determined() || !conditions_->needs_derivatives) return false;
  const bool inside = t > step.from.t && t < step.to.t;
  if (inside && point_.t != t) return false;
  if (!inside) point_ = t >= step.to.t ? step.to : step.from;
  const bool coarse = inside && !out.exact;
  if (coarse) predict(step, point_);
  // the ends of implicit steps satisfy the equations within the tolerances only
  if ((coarse || !stepper.is_explicit()) && !solve_at(stepper, point_, accuracy)) return false;
  const double length = of_step * (step.to.t - step.from.t);
  const double apart = t - length < step.from.t ? length : -length;
  tangent_point_ = point_;
  tangent_point_.t += apart;
  tangent_point_.x += apart * point_.xdot;
  if (!solve_at(stepper, tangent_point_, accuracy)) return false;
  evaluate(point_, neighbour_);
  const std::vector<double> g = neighbour_.g, parts = neighbour_.narrow;
  evaluate(tangent_point_, neighbour_);
  for (std::size_t i = 0; i < conditions_->measured.size(); ++i) {
    if (!conditions_->measured[i] || ignored_[i]) continue;
    out.slope[i] = (neighbour_.g[i] - g[i]) / apart;
    if (coarse) out.g[i] = g[i];
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (!conditions_->measured[conditions_->narrow[k]]) continue;
    out.bend[k] = (neighbour_.narrow[k] - parts[k]) / apart;
    if (coarse) out.narrow[k] = parts[k];
  }
  std::swap(last_solved_.at, point_);
  last_solved_.rate.xdot = (tangent_point_.xdot - last_solved_.at.xdot) / apart;
  last_solved_.rate.z = (tangent_point_.z - last_solved_.at.z) / apart;
  return true;
}

/// Slopes that the equations do not give as they are written.
void EventFinder::measure_slopes(Stepper& stepper, const StepView& step, double t, Sample& out,
                                 double closest) {
  if (!differentiate(stepper, step, t, out)) measure_along(stepper, step, t, out, closest);
}

/// Finite differences along the step for dg/dt of the conditions that contain x′ or z. Their g is evaluated,
/// too, since the coarse interpolant may know z at the ends of the step only.
void EventFinder::measure_along(Stepper& stepper, const StepView& step, double t, Sample& out,
                                double closest) {
  // A difference well above the errors of the step, or a closer one where it is asked for, and where a dip
  // may be narrow, whose turn would be seen late.
  const bool narrow = std::any_of(conditions_->narrow.begin(), conditions_->narrow.end(),
                                  [&](std::size_t i) { return conditions_->measured[i]; });
  const double usual = (step.to.t - step.from.t) / (narrow ? 1024 : 64);
  const double apart = closest > 0 ? std::min(closest, usual) : usual;
  const double at = std::min(t, step.to.t - apart / 2);
  const double beside = at - apart < step.from.t ? at + apart : at - apart;
  const auto conditions = [&](double time) {
    try {
      interpolate(stepper, step, time, Detail::full);
    } catch (const Failure&) {  // the equations are singular there; later steps will report it
      interpolate_coarsely(stepper, step, time);
    }
    evaluate(point_, neighbour_);
    return neighbour_.g;
  };
  const std::vector<double> g = conditions(at);
  const std::vector<double> parts = neighbour_.narrow;
  const std::vector<double> other = conditions(beside);
  for (std::size_t k = 0; k < parts.size(); ++k)
    if (conditions_->measured[conditions_->narrow[k]])
      out.bend[k] = (parts[k] - neighbour_.narrow[k]) / (at - beside);
  for (std::size_t i = 0; i < conditions_->measured.size(); ++i) {
    if (!conditions_->measured[i] || ignored_[i]) continue;
    out.slope[i] = (g[i] - other[i]) / (at - beside);
    if (!out.exact && at == t) out.g[i] = g[i];
  }
}

/// A sample by the cheapest interpolant that has z.
void EventFinder::sample_coarsely(Stepper& stepper, const StepView& step, double t, Sample& out) {
  sample(stepper, step, t, Detail::coarse, out);
  if (wants_.slopes) measure_slopes(stepper, step, t, out);
}

double EventFinder::value(Stepper& stepper, const StepView& step, int which, double t) {
  sample(stepper, step, t, conditions_->clock[which] ? Detail::coarse : Detail::state, probe_);
  return probe_.g[which];
}

/// The same on the coarse interpolant, with the x′ and z of the equations there. NaN: they are not known.
double EventFinder::coarse_value(Stepper& stepper, const StepView& step, int which, double t) {
  sample(stepper, step, t, Detail::coarse, probe_);
  if (!conditions_->measured[which] || !stepper.is_explicit() || t >= step.to.t) return probe_.g[which];
  if (!solve_at(stepper, point_, 0)) return std::numeric_limits<double>::quiet_NaN();
  evaluate(point_, probe_);
  return probe_.g[which];
}

}  // namespace pendula::integrate
