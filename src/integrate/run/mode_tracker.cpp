#include "integrate/run/mode_tracker.hpp"

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {

void ModeTracker::initialise(const Point& point) {
  if (state_.plan.modes == 0) return;
  state_.finder.start(point);
  set_modes(point, {});
}

Failure ModeTracker::sliding(const Event& surface) {
  return Failure(text("chattering: the solution crosses ", to_text(surface.when),
                      " = 0 again and again and slides along it. Regularise the equations there, for example "
                      "tanh(s/1e-3) in place of sign(s)"));
}

void ModeTracker::begin(const Point& point, const Crossings& crossed) {
  Stepper& stepper = state_.stepper();
  EventFinder& finder = state_.finder;
  if (point.t >= state_.end) state_.aim(point.t);
  if (state_.plan.modes == 0) {
    stepper.start(point, state_.end);
    finder.start(stepper.here());
    return;
  }
  finder.start(point);
  int changed = -1;
  for (std::size_t k = 0; k < 2 * events().size() + 2; ++k) {
    changed = set_modes(k == 0 ? point : Point(stepper.here()), crossed);
    if (k > 0 && changed < 0) return;
    stepper.start(point, state_.end);
    finder.start(stepper.here());
  }
  state_.reached = point.t;
  throw sliding(events()[changed]);
}

/// The side on which a solution goes on that is on a surface and does not leave it to first order: where x″
/// takes it.
double ModeTracker::side_ahead(int which, const Point& point) {
  if (!derivative_) derivative_ = std::make_unique<RhsSolver>(state_.problem, state_.stats());
  RhsSolver& derivative = *derivative_;
  Point ahead = point;
  const auto solve = [&] { return derivative(ahead.t, ahead.x.data(), ahead.xdot.data(), ahead.z.data()); };
  if (!solve()) return 0;
  const double dt = 1e-6 * state_.interval();
  ahead.t += dt;
  ahead.x += dt * ahead.xdot;
  if (!solve()) return 0;
  const double slope = state_.finder.slope(which, ahead);
  return (slope > 0) - (slope < 0);
}

/// Writes the modes of all sides into the problem; which surface has changed its mode, or -1.
int ModeTracker::set_modes(const Point& point, const Crossings& crossed) {
  std::vector<double> sides(events().size(), 0.0);
  for (std::size_t i = 0; i < sides.size(); ++i) sides[i] = state_.finder.side(static_cast<int>(i));
  for (const auto& crossing : crossed)
    if (double& side = sides[crossing.which]; side == 0) side = crossing.rising ? 1 : -1;
  const std::vector<double> before = modes_;
  use(sides);
  for (std::size_t i = 0; i < sides.size(); ++i)
    if (sides[i] == 0 && !events()[i].modes.empty()) sides[i] = side_ahead(static_cast<int>(i), point);
  use(sides);
  for (std::size_t i = 0; i < sides.size(); ++i)
    for (const Mode& mode : events()[i].modes) {
      const auto m = static_cast<std::size_t>(mode.number);
      if (before.empty() || modes_[m] != before[m]) return static_cast<int>(i);
    }
  return -1;
}

void ModeTracker::use(const std::vector<double>& sides) {
  modes_.resize(static_cast<std::size_t>(state_.plan.modes));
  for (std::size_t i = 0; i < sides.size(); ++i)
    for (const Mode& mode : events()[i].modes) modes_[mode.number] = mode.value(sides[i]);
  state_.history->use_modes(state_.problem, modes_);
}

bool ModeTracker::differ() const {
  for (int i = 0; i < static_cast<int>(events().size()); ++i) {
    const double side = state_.finder.side(i);
    for (const Mode& mode : events()[i].modes)
      if (side != 0 && mode.value(side) != modes_[mode.number]) return true;
  }
  return false;
}

}  // namespace pendula::integrate
