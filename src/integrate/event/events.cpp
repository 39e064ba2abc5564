#include "integrate/event/events.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/epsilon.hpp"
#include "dae/model/first_order.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

// Relative rounding errors. RhsSolver solves for unknowns to 1e-14 = 45 ε. A step adds h Σ bᵢ Kᵢ to a state
// (one rounding, ½ ε), and a state enters g by some dozen operations at most.
constexpr double rounding_of_solved = 64 * eps, rounding_of_state = 8 * eps;

}  // namespace

EventFinder::EventFinder(const ProblemPtr& problem, const std::vector<Event>& events, Stats* stats)
    : problem_(std::make_shared<Problem>(*problem)), events_(&events), along_{stats, {}, {}, {}, {}, {}} {
  ignored_.assign(events.size(), 0);
  finite_ = ignored_;
  beginnings_.resize(events.size());
  largest_.assign(events.size(), 0);
  last_solved_.at.t = std::numeric_limits<double>::infinity();
  std::vector<EventConditions::Condition> list;
  for (const Event& event : events) list.push_back({event.when, !event.termination_reason.empty()});
  conditions_ = EventConditions::of(*problem, list);
  kernel_ = conditions_->kernel;
  out_.resize(kernel_.outputs());
  count_wanted();
}

/// The quantities that the conditions need, ignored ones left out.
void EventFinder::count_wanted() {
  wants_ = {};
  for (std::size_t i = 0; i < ignored_.size(); ++i) {
    wants_.slopes = wants_.slopes || (conditions_->measured[i] && !ignored_[i]);
    wants_.solution = wants_.solution || (!conditions_->clock[i] && !ignored_[i]);
  }
}

double EventFinder::side(int which) const {
  const double g = last_.g[which];
  return (g > 0) - (g < 0);
}

void EventFinder::evaluate(const Point& point, double t, Sample& out) {
  problem_->set_point(t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), out_.data());
  const auto middle = out_.begin() + static_cast<std::ptrdiff_t>(events_->size());
  out.t = t;
  out.g.assign(out_.begin(), middle);
  const auto last = middle + static_cast<std::ptrdiff_t>(events_->size());
  out.slope.assign(middle, last);
  out.rate.assign(events_->size(), 0.0);
  for (std::size_t k = 0; k < conditions_->phases.size(); ++k) {
    const double rate = std::fabs(last[k]);
    if (std::isfinite(rate))
      out.rate[conditions_->phases[k]] = std::max(out.rate[conditions_->phases[k]], rate);
  }
  const std::size_t parts = conditions_->narrow.size();
  out.bend.assign(out_.end() - static_cast<std::ptrdiff_t>(parts), out_.end());
  out.narrow.assign(out_.end() - static_cast<std::ptrdiff_t>(2 * parts),
                    out_.end() - static_cast<std::ptrdiff_t>(parts));
  for (std::size_t i = 0; i < events_->size(); ++i)
    if (std::isfinite(out.g[i])) {
      finite_[i] = 1;
      largest_[i] = std::max(largest_[i], std::fabs(out.g[i]));
    }
  out.rounding_bound.assign(events_->size(), 0.0);
  // bodies may have come into contact at positions 0
  for (std::size_t i = 0; i < rounding_bound_.size(); ++i)
    if (rounding_bound_[i] > 0 && std::fabs(last_.g[i]) == tiny && may_reset(i))
      out.rounding_bound[i] = rounding(i);
  for (std::size_t i = 0; i < ignored_.size(); ++i)
    if (ignored_[i]) {
      out.g[i] = 1;
      out.slope[i] = 0;
      out.rate[i] = 0;
    }
  out.exact = true;
}

double EventFinder::slope(int which, const Point& point) {
  evaluate(point, probe_);
  return probe_.slope[which];
}

double EventFinder::slope_between(int which, const Point& a, const Point& b) {
  const double known = slope(which, b);
  if (conditions_->slope_known[which]) return known;
  const double g = probe_.g[which];
  evaluate(a, probe_);
  return (g - probe_.g[which]) / (b.t - a.t);
}

std::optional<int> EventFinder::never_finite() const {
  for (std::size_t i = 0; i < events_->size(); ++i) {
    const bool asked = !(*events_)[i].surface && (*events_)[i].termination_reason.empty();
    if (asked && !finite_[i]) return static_cast<int>(i);
  }
  return {};
}

void EventFinder::take_over(const EventFinder& before, std::size_t events) {
  along_.stats = before.along_.stats;
  std::copy_n(before.ignored_.begin(), events, ignored_.begin());
  std::copy_n(before.finite_.begin(), events, finite_.begin());
  std::copy_n(before.largest_.begin(), events, largest_.begin());
  count_wanted();
  uncounted_ = before.uncounted_;
  end_ = before.end_;
  span_ = before.span_;
}

void EventFinder::set_side(int which, int side) {
  last_.g[which] = std::copysign(tiny, side);
  rounding_bound_[which] = rounding(static_cast<std::size_t>(which));
}

/// Can a reset reverse the motion at the root of the condition?
bool EventFinder::may_reset(std::size_t i) const {
  const Event& event = (*events_)[i];
  return !event.surface && (event.call || !event.reset.empty());
}

/// The rounding error of an event function at the point of the last evaluation: a few ulp of its terms.
double EventFinder::rounding(std::size_t i) {
  if (!conditions_->slope_known[i])
    return conditions_->measured[i] && may_reset(i) ? rounding_of_solved * largest_[i] : 0;
  if (!(*events_)[i].surface && !may_reset(i)) return 0;
  if (terms_.empty()) terms_.resize(events_->size());
  if (terms_[i].outputs() == 0) {
    Expr sum;
    const Expr when = (*events_)[i].when;
    for (Expr leaf : leaves({&when, 1})) sum += abs(partial(when, leaf) * leaf);
    terms_[i] = codegen::Kernel(std::vector{sum}, problem_->arguments());
  }
  double size = 0;
  terms_[i](problem_->values().data(), &size);
  // Differences between two bodies in contact contain the rounding errors of all steps since, which differ.
  const double relative = may_reset(i) ? rounding_of_solved : rounding_of_state;
  return std::isfinite(size) ? relative * size : 0;
}

/// Is g zero up to its change within a few ulp of t?
bool EventFinder::is_zero(std::size_t i, const Sample& at) const {
  const double size =
      conditions_->slope_known[i] ? std::fabs(at.slope[i]) * std::max(span_, std::fabs(at.t)) : 0;
  return at.g[i] == 0 || std::fabs(at.g[i]) <= 64 * eps * size;
}

/// The same test where dg/dt is unknown, with the rate of change between two samples.
bool EventFinder::falls_to_zero(std::size_t i, const Sample& a, const Sample& b) const {
  const double rate = std::fabs(a.g[i] - b.g[i]) / (b.t - a.t);
  return std::fabs(b.g[i]) < std::fabs(a.g[i]) &&
         std::fabs(b.g[i]) <= 64 * eps * rate * std::max(span_, std::fabs(b.t));
}

std::optional<int> EventFinder::vanished(const Point& point) {
  evaluate(point, probe_);
  return vanished(probe_.g);
}

std::optional<int> EventFinder::vanished(const std::vector<double>& g) const {
  const auto is_piecewise = [](Expr e) {
    const auto nodes = topological({&e, 1});
    return std::any_of(nodes.begin(), nodes.end(), [](Expr n) {
      return n.op() == Op::abs || n.op() == Op::max || n.op() == Op::min || n.op() == Op::ifelse;
    });
  };
  for (std::size_t i = 0; i < events_->size(); ++i) {
    const Event& event = (*events_)[i];
    if (event.termination_reason.empty() || !(std::fabs(g[i]) <= 64 * eps * largest_[i])) continue;
    if (is_piecewise(event.when)) return static_cast<int>(i);
  }
  return {};
}

/// Is g hidden by the rounding errors of its terms, like the height of a bounce or the speed of a
/// surface that begins to slide? Large terms can hide every value of g, so g is compared with its own
/// largest value, too.
bool EventFinder::is_invisible(std::size_t i) {
  const double g = std::fabs(last_.g[i]);
  constexpr double small = 1e-12;  // of its largest value: 4500 ε
  return g <= small * largest_[i] && g <= rounding(i);
}

bool EventFinder::wanted(std::size_t i, bool rising) const {
  const int sign = dae::sign_of_slope((*events_)[i].direction);
  return sign == 0 || (sign > 0) == rising;
}

/// Replaces a zero at the beginning by the sign of g just after it.
void EventFinder::start(const Point& point, const std::vector<Crossing>& crossed) {
  if (events_->empty()) return;
  evaluate(point, last_);
  fresh_ = true;
  last_solved_.at.t = std::numeric_limits<double>::infinity();
  coarse_.has_before = coarse_.has_beginning = false;
  coarse_.knots.clear();
  // Near accumulation points of events the root of the continuous extension may differ much from that of the
  // solution. Then g is not small relative to its slope, but the root has been handled.
  beginnings_.assign(events_->size(), {});
  for (const Crossing& c : crossed) {
    double& g = last_.g[c.which];
    beginnings_[c.which] = {std::fabs(g - c.g) <= 1e-3 * std::fabs(c.g), c.rising ? -1 : 1};
    // an unknown computed anew in another branch is 0 up to the rounding errors of its equations and of t
    const double size = largest_[c.which] + std::fabs(c.slope) * std::max(span_, std::fabs(point.t));
    if (conditions_->measured[c.which] && std::fabs(g) <= rounding_of_solved * size) g = 0;
  }
  rounding_bound_.assign(events_->size(), 0.0);
  for (std::size_t i = 0; i < events_->size(); ++i) {
    if (!beginnings_[i].resumed && !is_zero(i, last_) && !is_invisible(i)) continue;
    rounding_bound_[i] = may_reset(i) ? std::max(rounding(i), tiny) : rounding(i);
    // sliding friction begins: the velocity is a rounding error, and so is its slope
    const bool level =
        (*events_)[i].surface && std::fabs(last_.slope[i]) * 1e-6 * span_ <= rounding_bound_[i];
    last_.g[i] = level || last_.slope[i] == 0 ? 0.0 : std::copysign(tiny, last_.slope[i]);
  }
}

/// Has the solution begun on the border and stayed there to within rounding?
bool EventFinder::stays_on_border(std::size_t i, const Sample& a, const Sample& b) const {
  return rounding_bound_[i] > 0 && std::fabs(a.g[i]) == tiny &&
         std::fabs(b.g[i]) <= std::max(rounding_bound_[i], b.rounding_bound[i]);
}

/// Is there a root at the end of the run, where no later step shows the change of sign?
bool EventFinder::ends_at_zero(std::size_t i, const Sample& a, const Sample& b) const {
  if (b.t < end_ || std::fabs(a.g[i]) <= tiny || opposite(a.g[i], b.g[i])) return false;
  if (!conditions_->slope_known[i] && !(*events_)[i].termination_reason.empty())
    return falls_to_zero(i, a, b);
  return a.g[i] * b.slope[i] < 0 && is_zero(i, b);
}

/// Verifies a sign change between coarse samples on the solution, where their errors might have made it.
/// Returns a root before the first, if the coarse sample had moved that out of its interval.
std::optional<EventFinder::Hit> EventFinder::verify_change(Stepper& stepper, const StepView& step, Sample& a,
                                                           Sample& b) {
  if (!changes(a, b)) return {};
  if (!is_certain(stepper, step, a, b)) {
    make_exact(stepper, step, a);
    if (changes(last_exact_, a))
      if (auto hit = first_hit(stepper, step, last_exact_, a)) return hit;
    last_exact_ = a;
  }
  if (!is_certain(stepper, step, b, a)) make_exact(stepper, step, b);
  return {};
}

std::optional<EventFinder::Hit> EventFinder::scan(Stepper& stepper, const StepView& step, Sample& a,
                                                  Sample& b, int depth, int turns) {
  constexpr int most_turns = 6;  // one beside the other: 64 in a quarter of a step
  if (auto hit = verify_change(stepper, step, a, b)) return hit;
  if (auto turned = turns < most_turns ? turning_point(stepper, step, a, b) : std::nullopt) {
    if (auto hit = scan(stepper, step, a, *turned, depth, turns + 1)) return hit;
    for (double& bend : turned->bend)
      if (std::fabs(bend) <= tiny) bend = -bend;  // behind the turn
    return scan(stepper, step, *turned, b, depth, turns + 1);
  }
  if (oscillates(a, b, depth) || may_hide(a, b, depth)) {
    Sample middle;
    sample_coarsely(stepper, step, a.t + (b.t - a.t) / 2, middle);
    if (auto hit = scan(stepper, step, a, middle, depth + 1, turns)) return hit;
    return scan(stepper, step, middle, b, depth + 1, turns);
  }
  decide_zeros(stepper, step, a, b);
  if (auto hit = verify_change(stepper, step, a, b)) return hit;
  if (auto hit = first_hit(stepper, step, a, b)) return hit;
  settle_zeros(a, b);
  if (b.exact) last_exact_ = b;
  return {};
}

/// Gives a sample inside the step with g = 0 the sign of g just after it. If that differs from the sign
/// before, there is a root. At the end of the step the next step decides.
void EventFinder::decide_zeros(Stepper& stepper, const StepView& step, const Sample& a, Sample& b) {
  constexpr double ahead = 1.0 / 64;  // relative to the rest of the step
  for (std::size_t i = 0; i < events_->size(); ++i) {
    if (b.g[i] != 0 || a.g[i] == 0 || b.t >= step.to.t || stays_on_border(i, a, b)) continue;
    make_exact(stepper, step, b);
    if (b.g[i] != 0 && std::fabs(b.g[i]) != tiny) continue;
    const double slope = b.slope[i];
    const double after =
        slope != 0 ? slope : value(stepper, step, static_cast<int>(i), b.t + ahead * (step.to.t - b.t));
    b.g[i] = after == 0 ? a.g[i] : std::copysign(tiny, after);
  }
}

bool EventFinder::changes(const Sample& a, const Sample& b) const {
  for (std::size_t i = 0; i < events_->size(); ++i)
    if (opposite(a.g[i], b.g[i])) return true;
  return false;
}

void EventFinder::make_exact(Stepper& stepper, const StepView& step, Sample& at) {
  if (at.exact) return;
  const std::vector<double> bend = at.bend;
  sample(stepper, step, at.t, Detail::state, at);
  for (std::size_t k = 0; k < bend.size(); ++k)
    if (std::fabs(bend[k]) <= tiny) at.bend[k] = bend[k];  // see turning_point()
  if (wants_.slopes) measure_slopes(stepper, step, at.t, at);
  settle_zeros(last_exact_, at);
}

/// Gives a sample with g = 0 that does not count as a root the sign of g just after it.
void EventFinder::settle_zeros(const Sample& a, Sample& b) const {
  for (std::size_t i = 0; i < events_->size(); ++i)
    if (stays_on_border(i, a, b))
      b.g[i] = a.g[i];
    else if (b.g[i] == 0)
      b.g[i] = a.g[i] == 0 ? 0.0 : std::copysign(tiny, b.slope[i]);
}

/// The slope of a condition that is 0 at the start of the search, extrapolated from the two closest values
/// that differ from it by more than rounding: an excursion that begins here may be shorter than the step. A
/// slope indistinguishable from 0 means that a reset has reversed the motion.
double EventFinder::slope_after(Stepper& stepper, const StepView& step, std::size_t i) {
  constexpr double closer = 8;
  const double invisible = rounding_of_solved * largest_[i];
  double slope = last_.slope[i], chord = 0;
  sample_near_start(stepper, step, last_.t, probe_);
  const double begin = probe_.g[i];
  for (double apart = (step.to.t - last_.t) / 64; apart > 4 * eps * span_; apart /= closer) {
    sample_near_start(stepper, step, last_.t + apart, probe_);
    if (!(std::fabs(probe_.g[i] - begin) > invisible)) break;
    const double next = (probe_.g[i] - begin) / apart;
    slope = chord == 0 ? next : (closer * next - chord) / (closer - 1);
    chord = next;
  }
  const bool level = std::fabs(slope) * 1e-7 * span_ <= invisible;
  return level && may_reset(i) && beginnings_[i].from != 0 ? beginnings_[i].from : slope;
}

std::optional<EventFinder::Hit> EventFinder::find(Stepper& stepper, const StepView& step) {
  const double from = last_.t, length = step.to.t - from;
  if (wants_.slopes && fresh_) {
    // a z that is 0 up to rounding has the digits of its terms only: apart by as much as the step allows
    if (std::any_of(last_.g.begin(), last_.g.end(), [](double g) { return std::fabs(g) <= tiny; }))
      measure_along(stepper, step, from, last_);
    else
      measure_slopes(stepper, step, from, last_);
    for (std::size_t i = 0; i < events_->size(); ++i)
      if (conditions_->measured[i] && last_.g[i] == 0 && last_.slope[i] != 0)
        last_.g[i] = std::copysign(tiny, slope_after(stepper, step, i));
  }
  fresh_ = false;
  begin_coarsely(stepper, step);
  if (stays_away(stepper, step)) {
    std::swap(last_, here_);
    return {};
  }
  refine(stepper, step);
  last_exact_ = last_;
  for (int k = 1; k <= pieces; ++k) {
    sample_coarsely(stepper, step, k == pieces ? step.to.t : from + length * k / pieces, here_);
    if (auto hit = scan(stepper, step, last_, here_, 0)) return hit;
    std::swap(last_, here_);
  }
  return {};
}

void EventFinder::pass(const Hit& hit, Stepper& stepper, const StepView& step) {
  sample(stepper, step, hit.t, Detail::state, last_);
  if (wants_.slopes) measure_slopes(stepper, step, hit.t, last_);
  add_knot(stepper, step, hit.t);
  for (const Crossing& crossing : hit.list)
    last_.g[crossing.which] = std::copysign(tiny, crossing.rising ? 1.0 : -1.0);
}

bool EventFinder::rests(const Hit& hit, Stepper& stepper, const StepView& step) {
  for (const Crossing& crossing : hit.list) {
    if (!may_reset(crossing.which)) return false;
    const double g = value(stepper, step, crossing.which, last_.t + (hit.t - last_.t) / 2);
    if (!(std::fabs(g) <= rounding(crossing.which))) return false;
  }
  sample(stepper, step, hit.t, Detail::state, last_);
  if (wants_.slopes) measure_slopes(stepper, step, hit.t, last_);
  for (const Crossing& crossing : hit.list) set_side(crossing.which, crossing.rising ? -1 : 1);
  return true;
}

}  // namespace pendula::integrate
