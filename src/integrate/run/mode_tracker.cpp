#include "integrate/run/mode_tracker.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {

ModeTracker::ModeTracker(AdaptiveState& state, MethodSelector& method)
    : state_(state),
      method_(method),
      jump_(state),
      across_(state),
      excursions_(state),
      uniqueness_(*state.problem),
      borders_(state.plan.events.list.size()) {}

void ModeTracker::initialise(const Point& point) {
  attempts_.t = point.t;
  if (state_.plan.modes == 0) return;
  state_.finder.start(point);
  set_modes(point, {});
}

Failure ModeTracker::chattering(const Event& surface) const {
  const std::string what =
      text("chattering: the solution crosses ", to_text(surface.when), " = 0 again and again, and ");
  for (Expr leaf : leaves({&surface.when, 1}))
    if (symbol_of(leaf).kind == Kind::input && state_.stepper().is_explicit())
      return Failure(text(what, "explicit methods cannot slide along it, since the slope of the input ",
                          to_text(leaf), " is unknown. Take method = \"radau\", or give ", to_text(leaf),
                          " as an expression of t"));
  return Failure(text(what, "no combination of both sides keeps it there. Regularise the equations, for ",
                      "example tanh(s/1e-3) in place of sign(s)"));
}

void ModeTracker::begin(const Point& point, const Crossings& crossed) {
  if (point.t >= state_.end) state_.set_step_end(point.t);
  begun_ = crossed;
  if (point.t != begun_at_) headed_.clear();
  begun_at_ = point.t;
  const bool on_edge = on_edge_of_domain(point, crossed);
  if (state_.plan.modes == 0 && weights_.empty()) {
    state_.stepper().start(point, state_.end);
    state_.finder.start(state_.stepper().here(), crossed);
  } else {
    begin_in_some_mode(point, crossed);
    headed_.insert(headed_.end(), crossed.begin(), crossed.end());
    std::erase_if(headed_, [&](const auto& crossing) {  // a reset may have left the border
      return !state_.finder.is_on_border(static_cast<std::size_t>(crossing.which));
    });
    for (Border& border : borders_) border.released = 0;
  }
  if (on_edge) begin_with_short_step();
  if (!uniqueness_.empty() && state_.solution->not_unique().empty())
    state_.solution->set_not_unique(
        uniqueness_.at(derivative(), state_.stepper().here(), state_.plan.tolerances, !crossed.empty()));
}

void ModeTracker::begin_in_some_mode(Point point, const Crossings& crossed) {
  bool leaves = false;
  for (const auto& crossing : crossed) {
    const Event& event = events()[crossing.which];
    if (!event.exit || is_frozen(static_cast<std::size_t>(event.exit->surface))) continue;
    if (!leaves) state_.problem->project(point.t, point.x);
    leaves = true;
    release(event.exit->surface, event.exit->side, point.t);
  }
  if (leaves) rebuild(point);
  const std::vector<double> arriving = modes_;
  std::vector<int> changed;
  bool passed = false;
  // where the domain of a function ends, its slope is infinite, and its branch is one behind the border only
  bool behind = std::any_of(crossed.begin(), crossed.end(), [&](const auto& crossing) {
    const Event& event = events()[crossing.which];
    return event.is_edge && !event.modes.empty() && is_frozen(static_cast<std::size_t>(crossing.which));
  });
  if (behind && begin_behind(point, crossed, true, arriving) && outside().empty()) return;
  for (std::size_t tries = 0; tries < 4 * borders_.size() + 4; ++tries) {
    bool found = false;
    try {
      found = try_modes(point, crossed, changed);
    } catch (const Failure&) {
      found = begin_behind(point, crossed, false, arriving);
      if (!found) throw;
    }
    if (!found && !passed && pass(crossed, changed)) {
      passed = true;
      continue;
    }
    if (!found && !behind) {
      behind = true;
      found = begin_behind(point, crossed, false, arriving);
    }
    if (found) {
      const auto leaving = outside();
      if (leaving.empty()) return;
      for (const auto& [which, side] : leaving) release(which, side, point.t);
      rebuild(point);
      continue;
    }
    Crossings all;
    for (int which : changed) all.push_back({which, true});
    if (unfreeze(all, point)) continue;
    if (std::none_of(changed.begin(), changed.end(), [&](int which) { return slide(which, point); })) break;
  }
  state_.reached = point.t;
  throw chattering(events()[changed.empty() ? crossed.front().which : changed.back()]);
}

/// A crossing is located to the tolerance of Newton's method, so that z solved for again, in either branch,
/// may still be on the old side. Where the equations are continuous, the solution continues in the direction
/// of the crossing.
bool ModeTracker::pass(const Crossings& crossed, const std::vector<int>& changed) {
  bool any = false;
  for (const auto& crossing : crossed) {
    const bool undecided = std::find(changed.begin(), changed.end(), crossing.which) != changed.end();
    if (!undecided || !is_continuous({crossing})) continue;
    borders_[crossing.which].released = crossing.rising ? 1 : -1;
    any = true;
  }
  return any;
}

/// False if every choice of modes leads to another one. `changed`: the surfaces that disagree.
bool ModeTracker::try_modes(Point point, const Crossings& crossed, std::vector<int>& changed) {
  Stepper& stepper = state_.stepper();
  start_finder(point, crossed);
  bool across = false;  // the values at the point come from AcrossBorders, and their sides are adopted first
  for (std::size_t k = 0; k < 2 * borders_.size() + 2; ++k) {
    changed = set_modes(k == 0 || across ? point : Point(stepper.here()), crossed);
    if (k > 0 && !across && changed.empty()) return true;
    try {
      stepper.start(point, state_.end);
      start_finder(stepper.here(), crossed);
      across = false;
    } catch (const Failure&) {
      if (across || !across_.solve(point, modes_, treatments())) throw;
      across = true;
      start_finder(point, crossed);
    }
  }
  return false;
}

void ModeTracker::start_finder(const Point& point, const Crossings& crossed) {
  state_.finder.start(point, crossed);
  for (std::size_t i = 0; i < borders_.size(); ++i)
    if (borders_[i].released != 0) state_.finder.set_side(static_cast<int>(i), borders_[i].released);
}

RhsSolver& ModeTracker::derivative() {
  if (!derivative_) derivative_ = std::make_unique<RhsSolver>(state_.problem, state_.stats());
  return *derivative_;
}

/// The mean slope of a border function after a point, over a share of the run.
double ModeTracker::slope_ahead(int which, const Point& point, double share) {
  RhsSolver& derivative = this->derivative();
  Point ahead = point;
  const auto solve = [&] { return derivative(ahead.t, ahead.x.data(), ahead.xdot.data(), ahead.z.data()); };
  if (!solve()) return 0;
  const Point here = ahead;
  const double dt = share * state_.interval();
  ahead.t += dt;
  ahead.x += dt * ahead.xdot;
  if (!solve()) return 0;
  return state_.finder.slope_between(which, here, ahead);
}

/// The side on which a solution continues that lies on a surface and does not leave it to first
/// order; x″ decides.
double ModeTracker::side_ahead(int which, const Point& point) {
  const double slope = slope_ahead(which, point, step_ahead);
  return (slope > 0) - (slope < 0);
}

/// Writes the modes of all sides into the problem; returns the surfaces whose modes have changed.
std::vector<int> ModeTracker::set_modes(const Point& point, const Crossings& crossed) {
  std::vector<double> sides(borders_.size(), 0.0);
  for (std::size_t i = 0; i < sides.size(); ++i) sides[i] = state_.finder.side(static_cast<int>(i));
  const std::vector<double> before = modes_;
  for (const auto& crossing : crossed) {
    if (static_cast<std::size_t>(crossing.which) >= sides.size() || sides[crossing.which] != 0) continue;
    sides[crossing.which] = crossing.rising ? 1 : -1;
    // with z in its condition only a look ahead shows whether the branch behind the border leads back to it
    const Event& event = events()[crossing.which];
    if (before.empty() || event.modes.empty() || event.smoothness != Smoothness::open ||
        state_.finder.knows_slope(crossing.which))
      continue;
    if (const double ahead = side_ahead(crossing.which, point); ahead != 0) sides[crossing.which] = ahead;
  }
  use(sides);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (sides[i] != 0 || !is_frozen(i) || events()[i].modes.empty()) continue;
    // in the branch that was chosen before, so that one which leads back to the border is noticed
    if (!before.empty())
      for (const Mode& mode : events()[i].modes) modes_[mode.number] = before[mode.number];
    use_modes();
    sides[i] = side_ahead(static_cast<int>(i), point);
  }
  use(sides);
  std::vector<int> changed;
  undecided_.clear();
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto& modes = events()[i].modes;
    if (sides[i] == 0 && is_frozen(i) && !modes.empty()) undecided_.push_back(i);
    if (is_frozen(i) && std::any_of(modes.begin(), modes.end(), [&](const Mode& mode) {
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
  use_modes();
}

void ModeTracker::use_modes() {
  state_.history->use_modes(state_.problem, modes_);
  state_.finder.set_modes(modes_);
}

bool ModeTracker::differ() const {
  constexpr double outside = -1e-6;  // for a weight in [0, 1]
  for (const Border& border : borders_)
    if (border.treatment == Treatment::sliding && border.exits)
      for (int k : {0, 1})
        if (state_.finder.values()[*border.exits + k] < outside) return true;
  for (std::size_t i = 0; i < borders_.size(); ++i) {
    const double side = state_.finder.side(static_cast<int>(i));
    if (side == 0 || !is_frozen(i)) continue;
    for (const Mode& mode : events()[i].modes)
      if (mode.value(side) != modes_[mode.number]) return true;
  }
  return false;
}

/// Does the solution with the branch of one side lead to the other side, at a speed above rounding?
bool ModeTracker::leads_to(int which, const Point& point, int other, int side) {
  const std::vector<double> in_force = modes_;
  const auto use_modes = [&] {
    state_.problem->set_modes(modes_);
    state_.finder.set_modes(modes_);
  };
  for (const Mode& mode : events()[which].modes) modes_[mode.number] = mode.value(side);
  use_modes();
  const double slope = slope_ahead(which, point, step_ahead),
               farther = slope_ahead(which, point, 10 * step_ahead);
  modes_ = in_force;
  use_modes();
  return slope * other > 0 && farther / slope > 0.5 && farther / slope < 2;
}

bool ModeTracker::has_chosen_side(const Point& before) {
  if (before.t != begun_at_) return false;
  bool any = false;
  for (const std::size_t i : undecided_) {
    const double side = state_.finder.side(static_cast<int>(i));
    if (side == 0 || !is_frozen(i)) continue;
    borders_[i].released = side > 0 ? 1 : -1;
    headed_.push_back({static_cast<int>(i), side > 0});
    any = true;
  }
  undecided_.clear();
  return any;
}

bool ModeTracker::slides_from_start(const Point& before) {
  if (before.t != begun_at_) return false;
  Point there = before;
  bool any = false;
  for (const auto& crossing : Crossings(headed_)) {
    const auto place = static_cast<std::size_t>(crossing.which);
    const int side = crossing.rising ? 1 : -1;
    if (place >= borders_.size() || is_continuous({crossing}) || events()[place].modes.empty()) continue;
    const bool has_left = borders_[place].left != 0 && borders_[place].left_at == before.t;
    if (has_left || state_.finder.side(crossing.which) != -side) continue;
    if (jump_.is_continuous(crossing.which, before)) continue;
    any = slide(crossing.which, there) || any;
  }
  return any;
}

void ModeTracker::require_way_on(const Point& before) {
  if (before.t != begun_at_) return;
  for (const auto& crossing : begun_) {
    const int which = crossing.which, side = crossing.rising ? 1 : -1;
    const Event& event = events()[which];
    const auto in_force = [&](const Mode& mode) { return modes_[mode.number] == mode.value(side); };
    if (!is_continuous({crossing}) || event.modes.empty() || !is_frozen(static_cast<std::size_t>(which)))
      continue;
    if (state_.finder.side(which) != -side || !std::all_of(event.modes.begin(), event.modes.end(), in_force))
      continue;
    if (!leads_to(which, before, -side, side) || !leads_to(which, before, side, -side)) continue;
    state_.reached = before.t;
    throw Failure(text(to_text(event.when),
                       " = 0 there, and the solutions of the equations on both sides of this ",
                       "border lead to the other side: no solution goes on"));
  }
}

// ── integrating through ──

bool ModeTracker::is_continuous(const Crossings& crossed) const {
  return std::all_of(crossed.begin(), crossed.end(), [&](const EventFinder::Crossing& crossing) {
    const Event& event = events()[crossing.which];
    return event.surface && event.smoothness != Smoothness::open;
  });
}

/// Unfreezes smooth borders that are crossed too often, so that the run integrates through them. Kinks stay
/// frozen: the error estimate does not detect a kink between two stages of a long step, and a rectifier that
/// blocks and conducts once within a step of high order loses all digits. (For kinks that the solution
/// crosses by rounding alone see ZenoDetector.)
void ModeTracker::count(const Crossings& crossed, const Point& point) {
  constexpr long quick = 2;  // steps between two crossings, for which the restart at the first was useless
  // consecutive quick crossings; fewer occur by chance where a solution oscillates about a border
  constexpr long often = 6;
  const long steps = state_.stats().steps;
  Crossings much;
  bool smooth = true;
  for (const auto& crossing : crossed) {
    if (!events()[crossing.which].surface || events()[crossing.which].exit) continue;
    Border& border = borders_[crossing.which];
    ++border.crossings;
    border.quick = steps - border.last_step <= quick ? border.quick + 1 : 0;
    border.last_step = steps;
    if (events()[crossing.which].smoothness != Smoothness::smooth)
      smooth = false;
    else if (border.quick >= often)
      much.push_back(crossing);
  }
  constexpr long enough = 40;  // fewer crossings cost little
  if (smooth && is_continuous(crossed) && ++crossings_ >= enough && 4 * crossings_ > steps)
    unfreeze_all(point, Smoothness::smooth);
  else if (!much.empty())
    unfreeze(much, point);
}

bool ModeTracker::unfreeze(const Crossings& crossed, const Point& point) {
  bool any = false;
  for (const auto& crossing : crossed) any = unfreeze_one(crossing.which, point) || any;
  if (any) rebuild(point);
  return any;
}

bool ModeTracker::unfreeze_all(const Point& point, Smoothness least) {
  bool any = false;
  for (std::size_t i = 0; i < borders_.size(); ++i)
    any = (events()[i].smoothness <= least && unfreeze_one(static_cast<int>(i), point)) || any;
  if (any) rebuild(point);
  return any;
}

bool ModeTracker::unfreeze_one(int which, const Point& point) {
  const Event& event = events()[which];
  if (!event.surface || event.exit || !is_frozen(static_cast<std::size_t>(which))) return false;
  if (event.smoothness == Smoothness::open && !jump_.is_continuous(which, point)) return false;
  Border& border = borders_[which];
  border.treatment = Treatment::unfrozen;
  border.since = point.t;
  return true;
}

/// The treatment of every surface, by surface number.
std::vector<Treatment> ModeTracker::treatments() const {
  std::vector<Treatment> treatment(borders_.size(), Treatment::frozen);
  for (std::size_t i = 0; i < borders_.size(); ++i)
    if (events()[i].surface) treatment[events()[i].surface_number] = borders_[i].treatment;
  return treatment;
}

/// Rebuilds the equations for the present treatment of every border and continues with them.
void ModeTracker::rebuild(const Point& point) {
  bool any = false;
  for (std::size_t i = 0; i < borders_.size(); ++i) {
    if (!events()[i].surface) continue;
    state_.finder.ignore(static_cast<int>(i), !is_frozen(i));
    any =
        any || !events()[i].modes.empty() || borders_[i].treatment == Treatment::sliding || !weights_.empty();
  }
  if (!any) return;
  Problem& problem = *state_.problem;
  problem.set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  std::unordered_map<Expr, double> values;
  for (std::size_t k = 0; k < problem.arguments().size(); ++k)
    values[problem.arguments()[k]] = problem.values()[k];
  TreatedProblem treated = state_.plan.treat(treatments(), values);
  weights_ = std::move(treated.weights);
  state_.use(std::move(treated.problem));
  derivative_.reset();
  method_.renew();
  state_.history->use_modes(state_.problem, modes_);
  renew_exits(values);
  std::vector<char> unfrozen(events().size(), 0);
  for (std::size_t i = 0; i < borders_.size(); ++i)
    unfrozen[i] = borders_[i].treatment == Treatment::unfrozen;
  excursions_.watch(std::move(unfrozen));
}

std::string ModeTracker::treatment_text(const Border& border) const {
  const auto times = [](long n) { return text(n, n == 1 ? " time" : " times"); };
  std::string what = text(", located ", times(border.crossings));
  if (border.slides > 0) {
    const bool still = border.treatment == Treatment::sliding;
    const double slid = border.slid + (still ? state_.reached - border.since : 0);
    what += border.slides == 1 && still
                ? text(", from t = ", rounded(border.since, 6), " on the solution slides along it")
                : text(", the solution slides along it ", times(border.slides), ", for ", rounded(slid, 6),
                       " in all");
  }
  if (border.treatment == Treatment::unfrozen)
    what += text(", from t = ", rounded(border.since, 6), " on integrated through");
  return what;
}

void ModeTracker::report() const {
  std::vector<BorderInUse> list;
  for (std::size_t i = 0; i < borders_.size(); ++i) {
    const Event& event = events()[i];
    if (!event.surface) continue;
    const char* kind = event.smoothness == Smoothness::smooth ? "smooth"
                       : event.smoothness == Smoothness::kink ? "kink"
                                                              : "jump or kink";
    list.push_back({event.when, kind + treatment_text(borders_[i])});
  }
  state_.solution->set_borders(std::move(list));
}

}  // namespace pendula::integrate
