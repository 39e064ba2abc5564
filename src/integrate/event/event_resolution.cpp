// How closely a step has to be looked at: where narrow parts of conditions turn, and where the cubic through
// the ends of the step does not follow the solution (docs/derivations.md#events).
#include "integrate/event/events.hpp"

#include <algorithm>
#include <cmath>

#include "base/epsilon.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/bracket.hpp"
#include "integrate/step/hermite.hpp"

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
/// interpolant.
double EventFinder::turn(Stepper& stepper, const StepView& step, std::size_t part, const Sample& a,
                         const Sample& b) {
  // relative to the piece; exact samples cost steps of the method, and turning_point() goes on from here
  const double close = conditions_->measured[conditions_->narrow[part]] ? 1e-7 : 1e-9;
  Bracket in{a.t, a.bend[part], b.t, b.bend[part]};
  double t = in.left;
  for (int k = 0; k < 40 && in.length() > close * (b.t - a.t); ++k) {
    const double before = t;
    const bool unknown = std::fabs(in.at_left) <= tiny || std::fabs(in.at_right) <= tiny;  // another turn
    t = unknown ? in.middle() : in.next(k);
    const double here = bend(stepper, step, part, t, Detail::coarse);
    if (!std::isfinite(here)) return in.middle();
    if (here == 0 || std::fabs(t - before) <= close * (b.t - a.t)) break;
    if (opposite(here, in.at_right))
      in.move_left(t, here);
    else
      in.move_right(t, here);
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

/// A sample between two turns of a part: where the cubic through both samples goes the other way in its
/// middle, and the part does so, too.
std::optional<EventFinder::Sample> EventFinder::between_turns(Stepper& stepper, const StepView& step,
                                                              std::size_t part, const Sample& a,
                                                              const Sample& b) {
  const double length = b.t - a.t, from = a.bend[part], to = b.bend[part];
  const double middle = 1.5 * (b.narrow[part] - a.narrow[part]) / length - (from + to) / 4;
  if (!opposite(from, middle) || !opposite(to, middle)) return {};
  if (std::min(std::fabs(from), std::fabs(to)) <= tiny) return {};
  Sample out;
  sample_coarsely(stepper, step, a.t + length / 2, out);
  return opposite(from, out.bend[part]) ? std::optional(out) : std::nullopt;
}

/// Moves a sample at the turn of the coarse interpolant to that of the solution, which is off by more than
/// the width of a dip: Newton's method, with the rate at which the slope of the part changes.
void EventFinder::move_to_turn(Stepper& stepper, const StepView& step, std::size_t part, const Sample& a,
                               const Sample& b, double change, Sample& at) {
  constexpr int most_tries = 6;  // Newton's method from the interpolant, with a fixed slope
  const std::size_t i = conditions_->narrow[part];
  const double length = b.t - a.t;
  double t = at.t;
  for (int tries = 0; tries < most_tries; ++tries) {
    sample(stepper, step, t, Detail::state, at);
    if (opposite(at.g[i], a.g[i])) break;
    const double here =
        conditions_->measured[i] ? bend(stepper, step, part, t, Detail::state) : at.bend[part];
    const double next = t - here / change;
    if (!(next > a.t && next < b.t) || std::fabs(next - t) <= 1e-6 * length) break;
    t = next;
  }
  if (at.t != t) sample(stepper, step, t, Detail::state, at);
  if (wants_.slopes) measure_slopes(stepper, step, t, at);
  settle_zeros(a, at);
}

/// A sample where a part turns between two samples, such as the exponent of exp(-((x - a)/w)^2) where x
/// passes a: however narrow a dip is, its bottom is there. Where the condition has a dip there, the sample
/// lies at the turn of the solution.
std::optional<EventFinder::Sample> EventFinder::turning_point(Stepper& stepper, const StepView& step,
                                                              const Sample& a, const Sample& b) {
  constexpr double deep = 0.5;  // a dip that leaves less of g
  const double length = b.t - a.t, beside = 1e-3 * length;
  if (!(length > 1e-6 * (step.to.t - step.from.t)) || !(length > 64 * eps * span_)) return {};
  for (std::size_t k = 0; k < conditions_->narrow.size(); ++k) {
    const std::size_t i = conditions_->narrow[k];
    if (ignored_[i] || !varies(k, a, b)) continue;
    if (!opposite(a.bend[k], b.bend[k])) {
      if (auto found = between_turns(stepper, step, k, a, b)) return found;
      continue;
    }
    const double t = turn(stepper, step, k, a, b);
    if (!(t > a.t && t < b.t)) continue;
    Sample out;
    sample_coarsely(stepper, step, t, out);
    const double sign = a.g[i] > 0 ? 1 : -1;
    const bool dips = !(sign * out.g[i] > deep * std::min(sign * a.g[i], sign * b.g[i]));
    double change = 0;
    if (!conditions_->measured[i] || dips) {
      const double right = std::min(t + beside, b.t), left = std::max(t - beside, a.t);
      change =
          (bend(stepper, step, k, right, Detail::coarse) - bend(stepper, step, k, left, Detail::coarse)) /
          (right - left);
    }
    if (dips && !out.exact && !opposite(a.g[i], b.g[i])) move_to_turn(stepper, step, k, a, b, change, out);
    const double margin =
        std::min(out.t - a.t, b.t - out.t);  // beside a sample its sign is that of this turn
    out.bend[k] = change == 0 || margin < beside ? 0.0 : std::copysign(tiny, -change);  // before the turn
    return out;
  }
  return {};
}

/// The cubic through the ends of a step of an explicit method is off in the middle by h⁴ x⁗/384. Where it is
/// continued to the beginning of the step before, its distance from the solution there shows that, without an
/// evaluation; in a first step the solution in the middle does (follows_coarsely()). Polynomials in t that a
/// method integrates exactly lead to steps of any length. Other methods have interpolants of their own.
void EventFinder::begin_coarsely(Stepper& stepper, const StepView& step) {
  coarse_.errors.assign(events_->size() + conditions_->narrow.size(), 0.0);
  if (!wants_.solution || !stepper.is_explicit()) return;
  const bool same = coarse_.has_beginning && coarse_.beginning.t == step.from.t;
  if (!same || coarse_.end != step.to.t) {
    coarse_.knots.clear();
    coarse_.off.resize(0);
  }
  coarse_.end = step.to.t;
  if (!same) {
    coarse_.has_before = coarse_.has_beginning;
    std::swap(coarse_.before, coarse_.beginning);
    coarse_.beginning = step.from;
    coarse_.has_beginning = true;
  }
  const double h = step.to.t - step.from.t;
  if (h > 0 && coarse_.has_before && coarse_.off.size() == 0) {
    const double back = step.from.t - coarse_.before.t;
    const double share = h * h / (4 * back * (back + h));  // square root of (s²(1 - s)²) at ½ and there
    hermite(step.from, step.to, -back / h, point_);
    coarse_.off = share * share * (coarse_.before.x - point_.x);
  }
  estimate_coarse_errors(step);
}

/// The errors of the conditions in the middle of the step, were it one piece as long as the longest between
/// knots: there the cubic is off by the fourth power of its share of the step.
void EventFinder::estimate_coarse_errors(const StepView& step) {
  if (coarse_.off.size() == 0) return;
  double longest = 0, from = step.from.t;
  for (const Point& knot : coarse_.knots) {
    if (knot.t > last_.t) longest = std::max(longest, knot.t - from);
    from = knot.t;
  }
  const double h = step.to.t - step.from.t, share = std::max(longest, step.to.t - from) / h;
  hermite(step, step.from.t + h / 2, point_);
  evaluate(point_, probe_);
  point_.x += share * share * share * share * coarse_.off;
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

/// Leads the coarse interpolant through the solution at a time of the step, at the cost of one exact look.
bool EventFinder::add_knot(Stepper& stepper, const StepView& step, double t) {
  if (!stepper.is_explicit() || !(t > step.from.t && t < step.to.t)) return false;
  auto& knots = coarse_.knots;
  const auto at = std::lower_bound(knots.begin(), knots.end(), t,
                                   [](const Point& knot, double time) { return knot.t < time; });
  if (at != knots.end() && at->t == t) return true;
  Point knot = step.to;
  try {
    stepper.interpolate(step, t, Detail::full, knot);
  } catch (const Failure&) {  // the equations are singular there; later steps will report it
    return false;
  }
  knots.insert(at, std::move(knot));
  return true;
}

/// The points between which the coarse interpolant is one cubic.
std::pair<const Point*, const Point*> EventFinder::piece(const StepView& step, double t) const {
  const auto& knots = coarse_.knots;
  const auto behind = std::upper_bound(knots.begin(), knots.end(), t,
                                       [](double time, const Point& knot) { return time < knot.t; });
  return {behind == knots.begin() ? &step.from : &*(behind - 1), behind == knots.end() ? &step.to : &*behind};
}

/// A point of the coarse interpolant, as point_. True if it is one of the solution.
bool EventFinder::interpolate_coarsely(Stepper& stepper, const StepView& step, double t) {
  if (coarse_.knots.empty()) {
    stepper.interpolate(step, t, Detail::coarse, point_);
    return false;
  }
  const auto [from, to] = piece(step, t);
  if (from->t == t && from != &step.from) {
    point_ = *from;
    return true;
  }
  hermite(*from, *to, (t - from->t) / (to->t - from->t), point_);
  point_.t = t;
  return false;
}

/// Halves the pieces of the coarse interpolant until it shows what the conditions do; at last its knots are
/// where the step is sampled.
void EventFinder::refine(Stepper& stepper, const StepView& step) {
  for (int parts = 2; parts <= pieces && !follows_coarsely(stepper, step); parts *= 2) {
    for (int k = 1; k < parts; k += 2) add_knot(stepper, step, last_.t + (step.to.t - last_.t) * k / parts);
    estimate_coarse_errors(step);
  }
}

/// Is the sign of a sample that of the solution, for every condition with another sign there? It is where it
/// stays when the point is moved by several times its error to either side.
bool EventFinder::is_certain(Stepper& stepper, const StepView& step, const Sample& at, const Sample& other) {
  constexpr double several = 8;  // the fourth derivative of x varies in the step
  if (at.exact) return true;
  const auto changes = [&](std::size_t i) { return opposite(at.g[i], other.g[i]) && !conditions_->clock[i]; };
  for (std::size_t i = 0; i < events_->size(); ++i)
    if (changes(i) && (conditions_->measured[i] || coarse_.off.size() == 0)) return false;
  if (coarse_.off.size() == 0) return true;  // only conditions of t change
  interpolate_coarsely(stepper, step, at.t);
  const auto [from, to] = piece(step, at.t);
  const double s = (at.t - from->t) / (to->t - from->t),
               share = (to->t - from->t) / (step.to.t - step.from.t);
  const double of_middle = 4 * s * (1 - s) * share * share;  // its square: 16 s²(1 - s)² of the fourth power
  const Vec off = several * of_middle * of_middle * coarse_.off;
  for (const double side : {1.0, -2.0}) {
    point_.x += side * off;
    evaluate(point_, neighbour_);
    for (std::size_t i = 0; i < events_->size(); ++i)
      if (changes(i) && !(at.g[i] * neighbour_.g[i] > 0)) return false;
  }
  return true;
}

/// Do samples of the coarse interpolant show what the conditions do in the step, but for details?
bool EventFinder::follows_coarsely(Stepper& stepper, const StepView& step) {
  constexpr double of_lowest = 0.25, of_highest = 0.02, of_part = 0.1;
  if (!wants_.solution || !stepper.is_explicit()) return true;
  if (coarse_.off.size() == 0) {
    const double middle = step.from.t + (step.to.t - step.from.t) / 2;
    if (!interpolate(stepper, step, middle, Detail::state)) return true;
    coarse_.off = point_.x;
    hermite(step, middle, point_);
    coarse_.off -= point_.x;
    add_knot(stepper, step, middle);
    estimate_coarse_errors(step);
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
