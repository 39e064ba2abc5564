#include "integrate/run/mode_tracker.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {

ModeTracker::ModeTracker(AdaptiveState& state, MethodSelector& method)
    : state_(state), method_(method), jump_(state), borders_(state.plan.events.list.size()) {}

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
  if (point.t >= state_.end) state_.aim(point.t);
  if (state_.plan.modes == 0) {
    state_.stepper().start(point, state_.end);
    state_.finder.start(state_.stepper().here(), crossed);
    return;
  }
  std::vector<int> changed;
  while (!try_modes(point, crossed, changed)) {
    Crossings all;
    for (int which : changed) all.push_back({which, true});
    if (thaw(all, point)) continue;
    state_.reached = point.t;
    throw sliding(events()[changed.back()]);
  }
}

/// False where every choice of modes leads to another one; `changed`: the surfaces that disagree.
bool ModeTracker::try_modes(const Point& point, const Crossings& crossed, std::vector<int>& changed) {
  Stepper& stepper = state_.stepper();
  state_.finder.start(point, crossed);
  for (std::size_t k = 0; k < 2 * events().size() + 2; ++k) {
    changed = set_modes(k == 0 ? point : Point(stepper.here()), crossed);
    if (k > 0 && changed.empty()) return true;
    stepper.start(point, state_.end);
    state_.finder.start(stepper.here(), crossed);
  }
  return false;
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
  const double slope = state_.finder.slope_between(which, point, ahead);
  return (slope > 0) - (slope < 0);
}

/// Writes the modes of all sides into the problem; which surfaces have changed theirs.
std::vector<int> ModeTracker::set_modes(const Point& point, const Crossings& crossed) {
  std::vector<double> sides(events().size(), 0.0);
  for (std::size_t i = 0; i < sides.size(); ++i) sides[i] = state_.finder.side(static_cast<int>(i));
  for (const auto& crossing : crossed)
    if (double& side = sides[crossing.which]; side == 0) side = crossing.rising ? 1 : -1;
  const std::vector<double> before = modes_;
  use(sides);
  for (std::size_t i = 0; i < sides.size(); ++i)
    if (sides[i] == 0 && !events()[i].modes.empty()) sides[i] = side_ahead(static_cast<int>(i), point);
  use(sides);
  std::vector<int> changed;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto& modes = events()[i].modes;
    if (!borders_[i].thawed && std::any_of(modes.begin(), modes.end(), [&](const Mode& mode) {
          return before.empty() || modes_[mode.number] != before[mode.number];
        }))
      changed.push_back(static_cast<int>(i));
  }
  return changed;
}

void ModeTracker::use(const std::vector<double>& sides) {
  modes_.resize(static_cast<std::size_t>(state_.plan.modes), 1.0);
  for (std::size_t i = 0; i < sides.size(); ++i)
    for (const Mode& mode : events()[i].modes) modes_[mode.number] = mode.value(sides[i]);
  state_.history->use_modes(state_.problem, modes_);
}

bool ModeTracker::differ() const {
  for (std::size_t i = 0; i < events().size(); ++i) {
    const double side = state_.finder.side(static_cast<int>(i));
    if (side == 0 || borders_[i].thawed) continue;
    for (const Mode& mode : events()[i].modes)
      if (mode.value(side) != modes_[mode.number]) return true;
  }
  return false;
}

// ── thawing ──

bool ModeTracker::is_continuous(const Crossings& crossed) const {
  return std::all_of(crossed.begin(), crossed.end(), [&](const EventFinder::Crossing& crossing) {
    const Event& event = events()[crossing.which];
    return event.surface && event.smoothness != Smoothness::open;
  });
}

void ModeTracker::count(const Crossings& crossed, const Point& point) {
  constexpr long quick = 2;  // steps between two crossings: the restart at one of them was of no use
  constexpr long often = 6;  // in a row: fewer happen by chance where a solution oscillates about a border
  const long steps = state_.stats().steps;
  Crossings much;
  for (const auto& crossing : crossed) {
    if (!events()[crossing.which].surface) continue;
    Border& border = borders_[crossing.which];
    ++border.crossings;
    border.quick = steps - border.last_step <= quick ? border.quick + 1 : 0;
    border.last_step = steps;
    if (border.quick >= often) much.push_back(crossing);
  }
  constexpr long enough = 40;  // crossings: fewer cost little in any case
  if (is_continuous(crossed) && ++crossings_ >= enough && 4 * crossings_ > steps)
    thaw_all(point);
  else if (!much.empty())
    thaw(much, point);
}

bool ModeTracker::thaw(const Crossings& crossed, const Point& point) {
  bool any = false;
  for (const auto& crossing : crossed) any = thaw_one(crossing.which, point) || any;
  if (any) use_thawed();
  return any;
}

bool ModeTracker::thaw_all(const Point& point) {
  bool any = false;
  for (std::size_t i = 0; i < events().size(); ++i)
    any = (events()[i].smoothness != Smoothness::open && thaw_one(static_cast<int>(i), point)) || any;
  if (any) use_thawed();
  return any;
}

bool ModeTracker::thaw_one(int which, const Point& point) {
  const Event& event = events()[which];
  Border& border = borders_[which];
  if (!event.surface || border.thawed) return false;
  if (event.smoothness == Smoothness::open && !jump_.is_continuous(which, point)) return false;
  border.thawed = true;
  border.thawed_at = point.t;
  state_.finder.ignore(which);
  return true;
}

/// The run goes on with equations in which the branches of thawed borders are as they are written.
void ModeTracker::use_thawed() {
  std::vector<char> thawed(events().size(), 0);
  bool frozen = false;
  for (std::size_t i = 0; i < events().size(); ++i) {
    if (!borders_[i].thawed) continue;
    thawed[events()[i].surface_number] = 1;
    frozen = frozen || !events()[i].modes.empty();
  }
  if (!frozen) return;
  state_.use(state_.plan.thaw(thawed));
  derivative_.reset();
  method_.renew();
  state_.history->use_modes(state_.problem, modes_);
}

void ModeTracker::report() const {
  std::vector<BorderInUse> list;
  for (std::size_t i = 0; i < events().size(); ++i) {
    const Event& event = events()[i];
    if (!event.surface) continue;
    const Border& border = borders_[i];
    std::string what = event.smoothness == Smoothness::smooth ? "smooth"
                       : event.smoothness == Smoothness::kink ? "kink"
                                                              : "jump or kink";
    const std::string times = text("located ", border.crossings, border.crossings == 1 ? " time" : " times");
    what += border.thawed
                ? text(", ", times, ", from t = ", rounded(border.thawed_at, 6), " on integrated through")
                : text(", ", times);
    list.push_back({event.when, what});
  }
  state_.solution->set_borders(std::move(list));
}

}  // namespace pendula::integrate
