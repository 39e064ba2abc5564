// The first root between two samples of the event functions (docs/derivations.md#events).
#include "integrate/event/events.hpp"

#include <algorithm>
#include <cmath>

#include "base/epsilon.hpp"
#include "integrate/event/bracket.hpp"

namespace pendula::integrate {

/// Does every condition stay away from zero in the step? Two cubics decide, one for each half of the step.
/// Their control points bound them; their error is estimated as `several` times that of the cubic through the
/// ends of the step, measured in the middle. Near an extremum g must also exceed the error of the coarse
/// interpolant (see bottom()). False for conditions that the error estimate does not control: those of time
/// alone, with dips, or whose slopes can only be measured along the step. Leaves the sample at the end of the
/// step in here_.
bool EventFinder::stays_away(Stepper& stepper, const StepView& step) {
  constexpr double several = 8;
  constexpr double of_slope = 0.143;  // maximum of s²(1-s)²(s-½) relative to its slope at ½
  constexpr double near = 0.01;       // relative to the largest value
  for (std::size_t i = 0; i < events_->size(); ++i)
    if (!ignored_[i] && (!(conditions_->slope_known[i] || conditions_->measured[i]) ||
                         conditions_->clock[i] || conditions_->may_dip[i] || std::fabs(last_.g[i]) <= tiny))
      return false;
  if (wants_.slopes && !stepper.is_determined()) return false;
  const double length = step.to.t - last_.t, third = length / 6;  // a third of the half step
  const auto is_far = [&](std::size_t i) {
    const double side = last_.g[i] > 0 ? 1 : -1;
    const double a = side * last_.g[i], m = side * probe_.g[i], b = side * here_.g[i];
    const double da = side * last_.slope[i], dm = side * probe_.slope[i], db = side * here_.slope[i];
    const double error = std::fabs((a + b) / 2 + length * (da - db) / 8 - m);
    const double slope_error = std::fabs(1.5 * (b - a) - length * ((da + db) / 4 + dm));
    const double lowest = std::min({a, b, m, a + third * da, b - third * db, m - third * std::fabs(dm)});
    const double steepest = std::max({std::fabs(da), std::fabs(dm), std::fabs(db)});
    if (lowest < std::min(a, b) && !(steepest * length < lowest)) return false;
    const double turns = std::max({last_.rate[i], probe_.rate[i], here_.rate[i]}) * length;
    return lowest > several * (error + of_slope * slope_error) && lowest > 2 * coarse_.errors[i] &&
           lowest > near * std::max({a, m, b}) && turns <= 1;
  };
  sample_coarsely(stepper, step, last_.t + length / 2, probe_);
  sample_coarsely(stepper, step, step.to.t, here_);
  for (std::size_t i = 0; i < events_->size(); ++i)
    if (!ignored_[i] && !is_far(i)) return false;
  return true;
}

/// A zero on the coarse interpolant between points of opposite sign: where to look at the solution first.
double EventFinder::coarse_root(Stepper& stepper, const StepView& step, int which, Bracket in) {
  constexpr double close = 1e-4;  // of the piece; the error of the interpolant is usually no smaller
  const double enough = close * in.length();
  double t = in.left;
  for (int k = 0; k < 40 && in.length() > enough; ++k) {
    const double before = t;
    const bool unknown = std::fabs(in.at_left) <= 2 * tiny || std::fabs(in.at_right) <= 2 * tiny;
    t = unknown ? in.middle() : in.next(k);
    const double g = coarse_value(stepper, step, which, t);
    if (!std::isfinite(g)) return in.middle();
    if (g == 0 || std::fabs(t - before) <= enough) break;
    if (opposite(g, in.at_right))
      in.move_left(t, g);
    else
      in.move_right(t, g);
  }
  return t;
}

/// The root between points of opposite sign: the end of the bracket at which the sign has changed. Values
/// below the rounding bound count as the sign of ga. The coarse interpolant shows where to look at the
/// solution; its error there, and from the second look on the line through the last two errors, correct it.
EventFinder::Root EventFinder::locate(Stepper& stepper, const StepView& step, int which, double a, double ga,
                                      double b, double gb, double rounding_bound) {
  constexpr int patience = 8;  // looks; then the bracket decides alone
  Bracket in{a, ga, b, gb};
  const double smallest = 2 * eps * std::max(std::fabs(a), std::fabs(b));
  const auto root = [&](double t) {
    return Root{std::max(in.left, t - smallest), t, false};
  };  // exact zeros: a lies far from the root
  CorrectedZero zero;
  for (int k = 0; k < 200; ++k) {
    if (in.length() <= smallest || in.at_right == 0) break;
    const auto coarse = [&](double t) { return coarse_value(stepper, step, which, t); };
    double t = k >= patience ? in.next(k)
               : k == 0      ? coarse_root(stepper, step, which, in)
                             : zero.next(coarse, in, smallest);
    t = std::clamp(std::isfinite(t) ? t : in.next(k), in.left + smallest / 2, in.right - smallest / 2);
    const double g = value(stepper, step, which, t);
    if (g == 0 && rounding_bound == 0) return root(t);
    if (k < patience) zero.look(t, g, coarse(t));
    if (opposite(g, in.at_right))
      in.move_left(t, g);
    else if (std::fabs(g) <= rounding_bound)
      in.move_left(t, std::copysign(tiny, -in.at_right));
    else
      in.move_right(t, g);
  }
  return root(in.right);
}

/// Finds where g touches or crosses zero between two samples of one sign, by bisection on the sign of its
/// slope. Ends without a root where the tangents at both ends of a small part meet well above zero, since a
/// convex curve lies above them. (A curve with an inflection, like a sine, need not; but its chord is steeper
/// than one of the tangents.) Ends also where neither tangents nor chord approach zero over the whole part:
/// the slopes of the coarse interpolant are not the derivatives of its values, and disagree with the chord
/// where g hardly changes.
EventFinder::Dip EventFinder::dip(Stepper& stepper, const StepView& step, int which, const Sample& a,
                                  const Sample& b, Detail detail) {
  constexpr double well = 0.5;   // relative to the smaller value
  constexpr int small_part = 6;  // halvings; over longer parts the curvature may vary too much
  const auto i = static_cast<std::size_t>(which);
  const double sign = b.g[i] > 0 ? 1 : -1;
  struct Side {
    double t, g, slope;
  };
  Side low{a.t, sign * a.g[i], sign * a.slope[i]}, high{b.t, sign * b.g[i], sign * b.slope[i]};
  for (int k = 0; k < 40 && high.t - low.t > 4 * eps * std::max(std::fabs(low.t), std::fabs(high.t)); ++k) {
    const double chord = (high.g - low.g) / (high.t - low.t);
    const bool bends_up = low.slope <= chord && chord <= high.slope;
    const double to_meeting = (high.g - low.g - high.slope * (high.t - low.t)) / (low.slope - high.slope);
    const double lower = std::min(low.g, high.g);
    const double steepest = std::max({std::fabs(low.slope), std::fabs(high.slope), std::fabs(chord)});
    const bool stays = steepest * (high.t - low.t) < (1 - well) * lower;
    if (k >= small_part && (stays || (bends_up && low.g + low.slope * to_meeting > well * lower)))
      return {{}, low.t, sign * low.g};
    const double t = (low.t + high.t) / 2;
    sample(stepper, step, t, detail, probe_);
    if (conditions_->measured[i] && !probe_.exact) measure_slopes(stepper, step, t, probe_);
    const double g = sign * probe_.g[i];
    if (g < 0) return {t, t, sign * g};
    if (conditions_->measured[i] && probe_.exact)
      measure_slopes(stepper, step, t, probe_, (high.t - low.t) / 8);
    const Side middle{t, g, sign * probe_.slope[i]};
    (middle.slope < 0 ? low : high) = middle;
  }
  return {{}, low.t, 0};
}

/// The bottom of the solution where it lies just beside the piece in which the coarse samples have it.
std::optional<double> EventFinder::bottom_beside(Stepper& stepper, const StepView& step, int which,
                                                 const Sample& a, const Sample& b) {
  const auto i = static_cast<std::size_t>(which);
  const double sign = b.g[i] > 0 ? 1 : -1, apart = (b.t - a.t) / 4;
  const auto search = [&](double from, double to) -> std::optional<double> {
    Sample low, high;
    sample(stepper, step, from, Detail::state, low);
    sample(stepper, step, to, Detail::state, high);
    if (!(sign * low.slope[i] < 0) || !(sign * high.slope[i] > 0)) return {};
    if (!(sign * low.g[i] > 0) || !(sign * high.g[i] > 0)) return {};
    return dip(stepper, step, which, low, high, Detail::state).below;
  };
  if (conditions_->measured[i]) return {};
  if (!b.exact && b.t < step.to.t)
    if (const auto found = search(b.t, std::min(b.t + apart, step.to.t))) return found;
  if (!a.exact && a.t - apart > last_exact_.t) return search(a.t - apart, a.t);
  return {};
}

/// dip() on the solution, after a search on the coarse interpolant, which needs no evaluation of the
/// equations. The coarse search decides alone in two cases: its minimum is well above zero and the solution
/// agrees there, or the steepest slope (at the ends of the step or near the minimum) is too small for g to
/// reach zero within the step. In the second case the error of the coarse interpolant, a fraction of the
/// change of g in the step, is too small as well.
std::optional<double> EventFinder::bottom(Stepper& stepper, const StepView& step, int which, const Sample& a,
                                          const Sample& b) {
  constexpr double close = 0.125;  // relative to g; small compared with the half that `well` leaves
  const auto i = static_cast<std::size_t>(which);
  const auto is_far = [&](double g) {
    if (conditions_->measured[i]) return false;
    double steepest = std::max(std::fabs(a.slope[i]), std::fabs(b.slope[i]));
    for (double end : {step.from.t, step.to.t}) {
      sample(stepper, step, end, Detail::coarse, probe_);
      steepest = std::max(steepest, std::fabs(probe_.slope[i]));
    }
    return steepest * (step.to.t - step.from.t) < std::fabs(g);
  };
  if (!conditions_->measured[i] || stepper.is_determined()) {
    const Dip coarse = dip(stepper, step, which, a, b, Detail::coarse);
    const auto agrees = [&] {
      return std::fabs(value(stepper, step, which, coarse.t) - coarse.lowest) <=
             close * std::fabs(coarse.lowest);
    };
    if (!coarse.below && coarse.lowest != 0 && (is_far(coarse.lowest) || agrees())) return {};
  }
  const auto inside = dip(stepper, step, which, a, b, Detail::state).below;
  return inside ? inside : bottom_beside(stepper, step, which, a, b);
}

/// Moves on until a condition has changed its sign; false: it does not in the step.
bool EventFinder::move_on(Stepper& stepper, const StepView& step, int which, double before, double apart,
                          double& t, double& g) {
  while (!opposite(before, g = value(stepper, step, which, t))) {
    if (t >= step.to.t) return false;
    t = std::min(t + apart, step.to.t);
  }
  return true;
}

/// The root in a bracket between two samples. A coarse sample may have the sign of the other side: then the
/// search ends there, and the root lies beside it.
std::optional<EventFinder::Root> EventFinder::locate_or_beside(Stepper& stepper, const StepView& step,
                                                               int which, const Sample& a, const Sample& b,
                                                               Bracket in, double rounding_bound) {
  const auto found = [&](double from, double at_from, double to, double at_to) {
    return locate(stepper, step, which, from, at_from, to, at_to, rounding_bound);
  };
  const Root root = found(in.left, in.at_left, in.right, in.at_right);
  if (!a.exact && root.before <= a.t) {
    const double g = value(stepper, step, which, a.t), before = last_exact_.g[which];
    if (opposite(g, in.at_right)) return root;
    return opposite(before, g) ? std::optional(found(last_exact_.t, before, a.t, g)) : std::nullopt;
  }
  if (b.exact || root.t < b.t || b.t >= step.to.t) return root;
  double right = b.t, g = in.at_right;
  if (!move_on(stepper, step, which, in.at_left, (b.t - a.t) / 4, right, g)) return {};
  return right > b.t ? found(root.before, in.at_left, right, g) : root;
}

std::optional<EventFinder::Root> EventFinder::root_between(Stepper& stepper, const StepView& step, int which,
                                                           const Sample& a, const Sample& b) {
  const auto i = static_cast<std::size_t>(which);
  double left = a.t, ga = a.g[i], right = b.t, gb = b.g[i];
  bool rising = ga < 0;
  if (stays_on_border(i, a, b)) return {};
  if (ends_at_zero(i, a, b)) return wanted(i, rising) ? std::optional(Root{b.t, b.t, rising}) : std::nullopt;
  if (gb == 0 && right >= step.to.t)
    return ga != 0 && wanted(i, rising) ? std::optional(Root{b.t, b.t, rising}) : std::nullopt;
  if (!opposite(ga, gb)) {
    const bool toward = a.slope[i] * gb < 0 && b.slope[i] * gb > 0 && ga != 0;
    const auto touch = toward ? bottom(stepper, step, which, a, b) : std::nullopt;
    if (!touch) return {};
    const double below = value(stepper, step, which, *touch);
    if (wanted(i, rising)) {
      right = *touch;
      gb = below;
      // the samples at both ends may be coarse ones, and the solution further along than they say
      if (!a.exact && (right <= left || !opposite(ga = value(stepper, step, which, left), gb))) {
        left = last_exact_.t;
        ga = last_exact_.g[i];
        if (!opposite(ga, gb)) return {};
      }
    } else {  // only the return through zero is wanted
      left = *touch;
      ga = below;
      rising = !rising;
      if (right <= left) return {};
      // the return may lie behind a coarse sample
      if (!b.exact && !move_on(stepper, step, which, ga, (right - left) / 4, right, gb)) return {};
    }
  } else if (!wanted(i, rising)) {
    return {};
  }
  // `a` may be a root itself: bisect towards it until the sign of g just after it is found. Values below
  // the rounding error of g belong to that root. Otherwise a ball on a moving table would be reflected
  // while it still rises.
  const double rounding_bound = std::fabs(ga) <= tiny && may_reset(i) ? rounding_bound_[i] : 0;
  double t = left;
  for (int k = 0; std::fabs(ga) <= tiny; ++k) {
    // no sign found: g returns at once. That is another root if the step began at one, else rounding
    if (k == 48) return beginnings_[i].resumed ? std::optional(Root{left, right, rising}) : std::nullopt;
    t = left + (right - left) / 2;
    const double g = value(stepper, step, which, t);
    if (opposite(g, gb) || (rounding_bound > 0 && std::fabs(g) <= rounding_bound)) {
      left = t;
      ga = opposite(g, gb) ? g : std::copysign(2 * tiny, -gb);
    } else {
      right = t;
      gb = g;
    }
  }
  auto root = locate_or_beside(stepper, step, which, a, b, {left, ga, right, gb}, rounding_bound);
  if (root) root->rising = rising;
  return root;
}

/// The earliest root. A condition whose sign there differs from that at `a` has a root before it.
const std::optional<EventFinder::Root>& EventFinder::first_root(Stepper& stepper, const StepView& step,
                                                                const Sample& a, Roots& roots) {
  const auto earlier = [](const auto& p, const auto& q) { return p && (!q || p->t < q->t); };
  for (std::size_t tries = 0;; ++tries) {
    const auto& first = *std::min_element(roots.begin(), roots.end(), earlier);
    if (!first || tries == roots.size()) return first;
    Sample there;
    sample(stepper, step, first->t, Detail::state, there);
    bool again = false;
    for (std::size_t i = 0; i < roots.size(); ++i) {
      const bool is_first = roots[i] && roots[i]->t <= first->t;
      if (is_first || !opposite(a.g[i], there.g[i]) || is_zero(i, there)) continue;
      const auto root = root_between(stepper, step, static_cast<int>(i), a, there);
      if (!earlier(root, first)) continue;
      roots[i] = root;
      again = true;
    }
    if (!again) return first;
  }
}

/// The first root between two samples, with all others at the same time to within rounding.
std::optional<EventFinder::Hit> EventFinder::first_hit(Stepper& stepper, const StepView& step,
                                                       const Sample& a, const Sample& b) {
  Roots roots(events_->size());
  for (std::size_t i = 0; i < events_->size(); ++i)
    if (std::isfinite(a.g[i]) && std::isfinite(b.g[i]))
      roots[i] = root_between(stepper, step, static_cast<int>(i), a, b);
  const std::optional<Root>& first = first_root(stepper, step, a, roots);
  if (!first) return {};
  Hit hit{first->t, first->before, {}};
  sample(stepper, step, hit.t, Detail::state, probe_);
  const double close = 8 * eps * std::max(std::fabs(step.from.t), std::fabs(step.to.t));
  for (std::size_t i = 0; i < events_->size(); ++i) {
    const bool rising = roots[i] ? roots[i]->rising : a.g[i] < 0;
    const bool same = roots[i] && roots[i]->t - hit.t <= close;
    const bool soon = is_zero(i, probe_) && std::fabs(a.g[i]) > tiny && probe_.slope[i] * a.g[i] < 0;
    const double chord = (b.g[i] - a.g[i]) / (b.t - a.t);
    if (same || (soon && wanted(i, rising)))
      hit.list.push_back({static_cast<int>(i), rising, probe_.g[i], chord});
  }
  return hit;
}

}  // namespace pendula::integrate
