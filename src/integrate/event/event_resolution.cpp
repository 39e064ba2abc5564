// How closely a step has to be looked at: where narrow parts of conditions turn, and where the cubic through
// the ends of the step does not follow the solution (docs/derivations.md#events).
#include <algorithm>
#include <cmath>

#include "base/epsilon.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/events.hpp"

namespace pendula::integrate {

/// Can g have reached zero and returned between two samples of one sign? Judged by slopes too large for a
/// monotone or gently curved function.
bool EventFinder::may_hide(const Sample& a, const Sample& b, int depth) const {
  constexpr int deepest = 3, deepest_clock = 8;
  for (std::size_t i = 0; i < events_->size(); ++i) {
    if (depth >= (conditions_->clock[i] ? deepest_clock : deepest) || opposite(a.g[i], b.g[i])) continue;
    const double steepest = std::max(std::fabs(a.slope[i]), std::fabs(b.slope[i]));
    if (steepest * (b.t - a.t) > 1.5 * (std::fabs(a.g[i]) + std::fabs(b.g[i]))) return true;
  }
  return false;
}

/// Does the argument of a sine in a condition change by more than 1 rad? If the number of oscillations per
/// step stays beyond the limit, a border is sampled more coarsely and an event raises an error: resolving
/// them all would take forever.
bool EventFinder::oscillates(const Sample& a, const Sample& b, int depth) {
  constexpr int close = 12, coarse = 4;  // halvings: 4096 samples in a quarter of a step
  constexpr long many = 20000;           // samples with an unresolved sine, enough for several steps
  if (conditions_->phases.empty()) return false;
  for (std::size_t i = 0; i < events_->size(); ++i) {
    if (!(std::max(a.rate[i], b.rate[i]) * (b.t - a.t) > 1)) continue;
    if (depth < (uncounted_ > many ? coarse : close)) return true;
    const Event& event = (*events_)[i];
    if (++uncounted_ > many && !event.surface && event.termination_reason.empty())
      throw Oscillation(
          text("the condition of an event, ", to_text(event.when), ", oscillates too fast to be followed, ",
               "thousands of times in a step; leave the event out, or limit the steps by dtmax"));
  }
  return false;
}

/// The slope of a part at a time of the step. Where only values are known, a difference.
double EventFinder::bend(Stepper& stepper, const StepView& step, std::size_t part, double t, Detail detail) {
  sample(stepper, step, t, detail, probe_);
  if (!conditions_->measured[conditions_->narrow[part]] || differentiate(stepper, step, t, probe_))
    return probe_.bend[part];
  const double apart = (step.to.t - step.from.t) * 1e-4;
  const auto at = [&](double time) {
    sample(stepper, step, std::clamp(time, step.from.t, step.to.t), Detail::full, probe_);
    return probe_.narrow[part];
  };
  const double before = at(t - apart);
  return (at(t + apart) - before) / (2 * apart);
}

/// The zero of the slope of a part between two samples at which it has opposite signs, on the coarse
/// interpolant: the Illinois method.
double EventFinder::turn(Stepper& stepper, const StepView& step, std::size_t part, const Sample& a,
                         const Sample& b) {
  // relative to the piece; exact samples cost steps of the method, and turning_point() goes on from here
  const double close = coarse_.fails || conditions_->measured[conditions_->narrow[part]] ? 1e-7 : 1e-9;
  double left = a.t, right = b.t, at_left = a.bend[part], at_right = b.bend[part], t = left;
  for (int k = 0, side = 0; k < 40 && right - left > close * (b.t - a.t); ++k) {
    const double before = t;
    const bool unknown = std::fabs(at_left) <= tiny || std::fabs(at_right) <= tiny;  // another turn
    t = k % 4 == 3 || unknown ? (left + right) / 2 : right - at_right * (right - left) / (at_right - at_left);
    const double here = bend(stepper, step, part, t, coarse_.fails ? Detail::state : Detail::coarse);
    if (!std::isfinite(here)) return (left + right) / 2;
    if (here == 0 || std::fabs(t - before) <= close * (b.t - a.t)) break;
    if (opposite(here, at_right)) {
      left = t;
      at_left = here;
      if (side == -1) at_right /= 2;
      side = -1;
    } else {
      right = t;
      at_right = here;
      if (side == 1) at_left /= 2;
      side = 1;
    }
  }
  return t;
}

/// Does a part change between two samples by enough to make the condition narrow? A root far above 0 does
/// not.
bool EventFinder::varies(std::size_t part, const Sample& a, const Sample& b) const {
  constexpr double enough = 0.125;
  const double size = std::min(std::fabs(a.narrow[part]), std::fabs(b.narrow[part]));
  const double reach = std::max(std::fabs(a.bend[part]), std::fabs(b.bend[part])) * (b.t - a.t);
  const double change = std::max(reach, std::fabs(b.narrow[part] - a.narrow[part]));
  return change > enough * (conditions_->is_exponent[part] ? std::min(size, 1.0) : size);
}

/// A sample where a part turns between two samples, such as the exponent of exp(-((x - a)/w)^2) where x
/// passes a: however narrow a dip is, its bottom is there. Where the condition has a dip there, the sample
/// lies at the turn of the solution, which the coarse interpolant may miss by more than the width of the dip.
std::optional<EventFinder::Sample> EventFinder::turning_point(Stepper& stepper, const StepView& step,
                                                              const Sample& a, const Sample& b) {
  constexpr double deep = 0.5;  // a dip that leaves less of g
  const double length = b.t - a.t;
  if (!(length > 1e-6 * (step.to.t - step.from.t)) || !(length > 64 * eps * span_)) return {};
  for (std::size_t k = 0; k < conditions_->narrow.size(); ++k) {
    const std::size_t i = conditions_->narrow[k];
    if (ignored_[i] || !varies(k, a, b)) continue;
    if (!opposite(a.bend[k], b.bend[k])) {
      // two turns: the cubic through both samples goes the other way in its middle
      const double middle = 1.5 * (b.narrow[k] - a.narrow[k]) / length - (a.bend[k] + b.bend[k]) / 4;
      if (!opposite(a.bend[k], middle) || !opposite(b.bend[k], middle)) continue;
      if (std::min(std::fabs(a.bend[k]), std::fabs(b.bend[k])) <= tiny) continue;
      Sample out;
      sample_coarsely(stepper, step, a.t + length / 2, out);
      if (opposite(a.bend[k], out.bend[k])) return out;
      continue;
    }
    double t = turn(stepper, step, k, a, b);
    if (!(t > a.t && t < b.t)) continue;
    Sample out;
    sample_coarsely(stepper, step, t, out);
    const double sign = a.g[i] > 0 ? 1 : -1;
    const bool dips = !(sign * out.g[i] > deep * std::min(sign * a.g[i], sign * b.g[i]));
    const Detail detail = coarse_.fails ? Detail::state : Detail::coarse;
    double change = 0;
    if (!conditions_->measured[i] || dips) {
      const double right = std::min(t + length * 1e-3, b.t), left = std::max(t - length * 1e-3, a.t);
      change =
          (bend(stepper, step, k, right, detail) - bend(stepper, step, k, left, detail)) / (right - left);
    }
    if (dips && !out.exact && !opposite(a.g[i], b.g[i])) {
      for (int tries = 0; tries < 6; ++tries) {
        sample(stepper, step, t, Detail::state, out);
        if (opposite(out.g[i], a.g[i])) break;
        const double here = conditions_->measured[i] ? bend(stepper, step, k, t, Detail::state) : out.bend[k];
        const double next = t - here / change;
        if (!(next > a.t && next < b.t) || std::fabs(next - t) <= 1e-6 * length) break;
        t = next;
      }
      if (out.t < t || out.t > t) sample(stepper, step, t, Detail::state, out);
      if (wants_.slopes) measure_slopes(stepper, step, t, out);
      settle_zeros(a, out);
    }
    const double margin = std::min(t - a.t, b.t - t);  // beside a sample its sign there is that of this turn
    out.bend[k] =
        change == 0 || margin < 1e-3 * length ? 0.0 : std::copysign(tiny, -change);  // before the turn
    return out;
  }
  return {};
}

/// The cubic through the ends of a step of an explicit method is off in the middle by h⁴ x⁗/384. Where it is
/// continued to the beginning of the step before, its distance from the solution there shows that, without an
/// evaluation; in a first step the solution in the middle does (follows_coarsely()). Polynomials in t that a
/// method integrates exactly lead to steps of any length. Other methods have interpolants of their own.
void EventFinder::estimate_coarse_errors(Stepper& stepper, const StepView& step) {
  coarse_.errors.assign(events_->size() + conditions_->narrow.size(), 0.0);
  if (!wants_.solution || !stepper.is_explicit()) return;
  if (!coarse_.has_beginning || coarse_.beginning.t != step.from.t) {
    coarse_.has_before = coarse_.has_beginning;
    std::swap(coarse_.before, coarse_.beginning);
    coarse_.beginning = step.from;
    coarse_.has_beginning = true;
  }
  const double h = step.to.t - step.from.t, middle = step.from.t + h / 2;
  if (!(h > 0) || !coarse_.has_before) return;
  const double back = step.from.t - coarse_.before.t, s = -back / h;
  const double share = h * h / (4 * back * (back + h));  // square root of (s²(1 - s)²) at ½ and there
  const auto& a = step.from;
  const auto& b = step.to;
  const double h00 = (1 + 2 * s) * (1 - s) * (1 - s), h10 = s * (1 - s) * (1 - s);
  const double h01 = s * s * (3 - 2 * s), h11 = s * s * (s - 1);
  const Vec off = coarse_.before.x - (h00 * a.x + h01 * b.x + h * (h10 * a.xdot + h11 * b.xdot));
  stepper.interpolate(step, middle, Detail::coarse, point_);
  compare_coarsely(share * share * off);
}

/// The errors of the conditions at point_, which is off by so much.
void EventFinder::compare_coarsely(const Vec& off) {
  evaluate(point_, probe_);
  point_.x += off;
  evaluate(point_, neighbour_);
  const std::size_t count = events_->size();
  for (std::size_t i = 0; i < count; ++i) {
    const double error = std::fabs(neighbour_.g[i] - probe_.g[i]);
    if (!conditions_->clock[i] && std::isfinite(error)) coarse_.errors[i] = error;
  }
  for (std::size_t k = 0; k < conditions_->narrow.size(); ++k) {
    const double error = std::fabs(neighbour_.narrow[k] - probe_.narrow[k]);
    const std::size_t i = conditions_->narrow[k];
    const double size = std::max(std::fabs(neighbour_.narrow[k]), std::fabs(probe_.narrow[k]));
    if (!conditions_->clock[i] && !ignored_[i] && size > 0) coarse_.errors[count + k] = error / size;
  }
}

/// Do samples of the coarse interpolant show what the conditions do in the step, but for details?
bool EventFinder::follows_coarsely(Stepper& stepper, const StepView& step) {
  constexpr double of_lowest = 0.25, of_highest = 0.02, of_part = 0.1;
  constexpr int pieces = 4;
  if (!wants_.solution || !stepper.is_explicit()) return true;
  if (!coarse_.has_before) {
    const double middle = step.from.t + (step.to.t - step.from.t) / 2;
    if (!interpolate(stepper, step, middle, Detail::state)) return true;
    const Vec exact = point_.x;
    interpolate(stepper, step, middle, Detail::coarse);
    compare_coarsely(exact - point_.x);
  }
  if (std::all_of(coarse_.errors.begin(), coarse_.errors.end(), [](double e) { return e == 0; })) return true;
  std::vector<double> lowest = last_.g, highest = last_.g;
  for (double& g : lowest) g = std::fabs(g);
  highest = lowest;
  for (int k = 1; k <= pieces; ++k) {
    const double t = k == pieces ? step.to.t : last_.t + (step.to.t - last_.t) * k / pieces;
    sample(stepper, step, t, Detail::coarse, probe_);
    for (std::size_t i = 0; i < lowest.size(); ++i) {
      lowest[i] = std::min(lowest[i], std::fabs(probe_.g[i]));
      highest[i] = std::max(highest[i], std::fabs(probe_.g[i]));
    }
  }
  for (std::size_t i = 0; i < coarse_.errors.size(); ++i) {
    const bool part = i >= lowest.size();
    if (part ? coarse_.errors[i] > of_part
             : coarse_.errors[i] > std::max(of_highest * highest[i], of_lowest * lowest[i]))
      return false;
  }
  return true;
}

}  // namespace pendula::integrate
