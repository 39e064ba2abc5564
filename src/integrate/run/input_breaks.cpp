#include "integrate/run/input_breaks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "integrate/event/jumps.hpp"

namespace pendula::integrate {

std::optional<double> InputBreaks::first_between(double from, double to, bool at_break) {
  const auto& inputs = state_.plan.monitored_inputs;
  std::optional<double> first;
  sizes_.resize(inputs.size());
  for (std::size_t i = 0; i < sizes_.size(); ++i)
    if (const auto t = find_break(inputs[i], from, to, at_break, sizes_[i]); t && (!first || *t < *first))
      first = t;
  return first;
}

/// The shortest interval that is integrated on its own.
double InputBreaks::shortest_part(double t) const {
  return std::max(1e-14 * state_.interval(), 32 * std::numeric_limits<double>::epsilon() * std::fabs(t));
}

bool InputBreaks::has_repeated_step() {
  if (state_.plan.monitored_inputs.empty()) return false;
  Stepper& stepper = state_.stepper();
  const double from = stepper.before().t, to = stepper.here().t;
  std::optional<double> first = first_between(from, to, to >= state_.end);
  if (!first || *first <= from) return false;
  // a jump at the beginning itself, u(0) = 0 and u(t) = 1 after it, gets an interval of its own
  const double moment = shortest_part(std::max(std::fabs(from), std::fabs(to)));
  if (*first - from < moment) {
    if (to - from <= 2 * moment) return false;
    first = from + moment;
  }
  --state_.stats().steps;
  ++state_.stats().rejected;
  state_.end = *first;
  state_.limit(*first);
  stepper.start(Point(stepper.before()), state_.end);
  return true;
}

bool InputBreaks::has_jumped_to_next(const Point& here) {
  if (state_.plan.monitored_inputs.empty()) return false;
  const auto first = first_between(here.t, here.t + shortest_part(here.t), false);
  if (!first || *first >= state_.plan.to) return false;
  Point behind = here;
  behind.t = *first;
  state_.set_step_end(behind.t);
  events_.begin_again(behind, {});
  state_.go_on(here);
  return true;
}

bool InputBreaks::pass() {
  Stepper& stepper = state_.stepper();
  const Point here = stepper.here();
  const std::vector<double> sides = events_.sides();
  state_.set_step_end(here.t);
  stepper.suggest(stepper.next_dt());
  events_.begin_again(here, {});
  stepper.suggest(0);
  state_.go_on(here);
  return events_.settle_carried(here, sides);
}

bool InputBreaks::are_at_end() const {
  return std::binary_search(state_.plan.breaks.begin(), state_.plan.breaks.end(), state_.plan.to);
}

void InputBreaks::arrive() {
  const Point here = state_.stepper().here();
  try {
    const std::vector<double> sides = events_.sides();
    state_.set_step_end(here.t);
    events_.begin_again(here, {});
    state_.go_on(here);
    events_.settle_carried(here, sides);
  } catch (const Failure&) {  // at the end of the run no continuation is needed
  }
}

}  // namespace pendula::integrate
