// On a border itself: a run begins behind it where a branch has no value or no slope on it, or slides along
// it until one of the sides takes it.
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/run/mode_tracker.hpp"

namespace pendula::integrate {

/// Where the domain of a function ends, on a border that has no branch, or where sliding along either ends.
bool ModeTracker::on_edge_of_domain(const Point& point, const Crossings& crossed) {
  const auto is_one = [](const Event& e) { return e.surface && (e.modes.empty() || e.is_edge); };
  const auto is_exit = [&](const EventFinder::Crossing& crossing) {
    const auto& exit = events()[crossing.which].exit;
    return exit && is_one(events()[exit->surface]);
  };
  if (std::any_of(crossed.begin(), crossed.end(), is_exit)) return true;
  if (std::none_of(events().begin(), events().end(), is_one)) return false;
  state_.finder.start(point, crossed);
  for (std::size_t i = 0; i < borders_.size(); ++i)
    if (is_one(events()[i]) && state_.finder.is_on_border(i)) return true;
  return false;
}

/// Step size after √|g| = 0, where error estimates have no order and those of high order miss the root. In
/// such a step x′ changes x by a tolerance only; 0 if no limit is needed. The second look follows the bend
/// of the solution: g′ = 0 where sliding ends.
double ModeTracker::step_beside_root(const Point& point) {
  constexpr double longest = 1e-2;  // of the interval
  constexpr int decades = 12;
  Point here = point;
  RhsSolver& derivative = this->derivative();
  const auto solve = [&](Point& at) { return derivative(at.t, at.x.data(), at.xdot.data(), at.z.data()); };
  if (!solve(here)) return 0;
  const Tolerances& tolerances = state_.plan.tolerances;
  double dt = longest * state_.interval();
  for (int k = 0; k < decades; ++k, dt /= 10) {
    Point ahead = here;
    ahead.t += dt;
    ahead.x += dt * here.xdot;
    if (!solve(ahead)) continue;
    Point bent = ahead;
    bent.x = here.x + dt * ahead.xdot;
    if (!solve(bent)) continue;
    double change = 0;
    for (Eigen::Index i = 0; i < here.x.size(); ++i)
      change = std::max(
          change,
          dt * std::max(std::fabs(ahead.xdot[i] - here.xdot[i]), std::fabs(bent.xdot[i] - here.xdot[i])) /
              (tolerances.atol[i] + tolerances.rtol[i] * std::fabs(here.x[i])));
    if (change <= 1) return k == 0 ? 0 : dt;
  }
  return dt;
}

/// The run has begun on the edge of a domain: begins again with a step that is short enough there, in the
/// modes with which it goes on.
void ModeTracker::begin_with_short_step() {
  Stepper& stepper = state_.stepper();
  const Point here = stepper.here();
  const double first = step_beside_root(here);
  if (first == 0) return;
  stepper.suggest(first);
  stepper.start(here, state_.end);
  stepper.suggest(0);
}

/// On its border a branch may have no value, sin(s)/s at s = 0, or no slope, where several borders meet.
/// Begins at a point behind it to which the branches lead that were in force before, if from there the
/// solution goes on away from it: the nearest, or as far as the tolerances allow, to be clear of rounding.
bool ModeTracker::begin_behind(const Point& point, const Crossings& crossed, bool nearest_first,
                               const std::vector<double>& arriving) {
  constexpr double farthest = 1e-6, nearest = 1e-15;  // of the interval
  constexpr int decades = 10;
  constexpr double share = 1;  // of a tolerance, in x: as a step may err
  if (crossed.empty() || arriving.empty()) return false;
  const auto leaves_it = [&](const EventFinder::Crossing& crossing) {
    return !events()[crossing.which].surface ||
           slope_ahead(crossing.which, state_.stepper().here(), farthest) * (crossing.rising ? 1 : -1) > 0;
  };
  const Tolerances& tolerances = state_.plan.tolerances;
  RhsSolver& derivative = this->derivative();
  const auto solve = [&](Point& at) { return derivative(at.t, at.x.data(), at.xdot.data(), at.z.data()); };
  double part = nearest_first ? nearest : farthest;
  for (int k = 0; k < decades; ++k, part *= nearest_first ? 10 : 0.1) {
    state_.history->use_modes(state_.problem, arriving);
    Point here = point;
    if (!solve(here)) return false;
    const double dt = part * std::max(state_.interval(), std::fabs(point.t));
    Point there = here;
    there.t += dt;
    there.x += dt * here.xdot;
    if (there.t >= state_.end || !solve(there)) continue;
    try {
      start_finder(there, {});
      set_modes(there, {});
      state_.problem->project(there.t, there.x);
      std::vector<int> changed;
      if (!try_modes(there, {}, changed)) continue;
    } catch (const Failure&) {
      continue;
    }
    const Point& now = state_.stepper().here();
    double change = 0;
    for (Eigen::Index i = 0; i < here.x.size(); ++i)
      change = std::max(
          change, dt * (std::fabs(now.xdot[i] - here.xdot[i]) + std::fabs(there.xdot[i] - here.xdot[i])) /
                      (tolerances.atol[i] + tolerances.rtol[i] * std::fabs(here.x[i])));
    if (change <= share && std::all_of(crossed.begin(), crossed.end(), leaves_it)) return true;
  }
  return false;
}

// ── sliding ──

bool ModeTracker::slide(int which, Point& point) {
  const Event& event = events()[which];
  const auto place = static_cast<std::size_t>(which);
  if (!event.surface || event.exit || !is_frozen(place) || state_.finder.is_moment(place)) return false;
  Border& border = borders_[which];
  if (border.released != 0) return false;
  border.treatment = Treatment::sliding;
  border.since = point.t;
  try {
    rebuild(point);
    Point there = point;
    state_.problem->project(there.t, there.x);
    try {
      state_.stepper().start(there, state_.end);
    } catch (const Failure&) {
      if (!method_.start_implicitly(there)) throw;
    }
    point = there;
  } catch (const UserFacing&) {
    border.treatment = Treatment::frozen;
    rebuild(point);
    return false;
  }
  ++border.slides;
  return true;
}

/// Begins to slide where the steps have become tiny. Near √|s| sign(s) = 0 a rounding error of s becomes an
/// error of 10⁻⁸ in x′, and the solution oscillates forever in steps a millionth of the usual size. An
/// attempt has to rebuild the equations, so the intervals between attempts are doubled.
bool ModeTracker::slide_where_steps_are_tiny() {
  constexpr double slow = 1e-5;  // of the interval per step
  for (std::size_t i = 0; i < borders_.size(); ++i)
    if (events()[i].surface && events()[i].smoothness == Smoothness::open)
      borders_[i].farthest = std::max(borders_[i].farthest, std::fabs(state_.finder.values()[i]));
  const long steps = state_.stats().steps, taken = steps - attempts_.steps;
  if (taken < attempts_.interval) return false;
  const Point point = state_.stepper().here();
  const bool tiny = point.t - attempts_.t < slow * static_cast<double>(taken) * state_.interval();
  attempts_.steps = steps;
  attempts_.t = point.t;
  std::vector<int> jumps;
  for (std::size_t i = 0; i < borders_.size(); ++i)
    if (events()[i].surface && events()[i].smoothness == Smoothness::open && !state_.finder.is_moment(i))
      jumps.push_back(static_cast<int>(i));
  const bool tries = tiny && !jumps.empty();
  if (tries) attempts_.interval *= 2;
  if (tries && !slide_along_one_of(jumps, point, true)) state_.stepper().start(point, state_.end);
  for (Border& border : borders_) border.farthest = 0;
  return tries;
}

/// Ten tolerances of x at the point, for the errors of a few steps.
Vec ModeTracker::errors_at(const Point& point) const {
  const Tolerances& tolerances = state_.plan.tolerances;
  const Eigen::Index n = point.x.size();
  return 10 * (tolerances.atol.head(n) + tolerances.rtol.head(n).cwiseProduct(point.x.cwiseAbs()));
}

/// How far s moves where every x moves by its error.
Expr ModeTracker::reach(int which, const Vec& errors) const {
  const std::vector<Expr>& x = state_.problem->model().x;
  const Expr when = events()[which].when;
  Expr sum(0);
  for (Expr leaf : leaves({&when, 1}))
    if (const auto at = std::find(x.begin(), x.end(), leaf); at != x.end())
      sum += abs(partial(when, leaf)) * Expr(errors[at - x.begin()]);
  return sum;
}

/// Borders that is_near() may hold for: that of a hundred transistors is none of those that another one has.
/// Of borders that contain x′ or z it is not known.
std::vector<int> ModeTracker::within_reach(const std::vector<int>& borders, const Point& point) const {
  constexpr double nonlinear = 2;
  const Vec errors = errors_at(point);
  const std::vector<Expr>& x = state_.problem->model().x;
  std::vector<Expr> questions;
  for (const int i : borders) {
    questions.push_back(events()[i].when);
    questions.push_back(reach(i, errors));
  }
  const Vec values = state_.solution->values(questions, point);
  std::vector<int> list;
  for (std::size_t k = 0; k < borders.size(); ++k) {
    const std::vector<Expr> inside = leaves({&questions[2 * k], 1});
    const bool by_states = std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
      const Kind kind = symbol_of(leaf).kind;
      return kind != Kind::variable || std::find(x.begin(), x.end(), leaf) != x.end();
    });
    const Eigen::Index at = static_cast<Eigen::Index>(2 * k);
    if (!by_states || !(std::fabs(values[at]) > nonlinear * values[at + 1])) list.push_back(borders[k]);
  }
  return list;
}

/// Does moving the point onto the borders change it by no more than its errors? If the equations contain a
/// root of s, that criterion fails (an error of s is magnified to its root in x′), and it is enough that s
/// has stayed small since the last attempt.
bool ModeTracker::is_near(const std::vector<int>& borders, const Point& point, const Point& there) const {
  const Vec allowed = errors_at(point);
  const bool by_root = std::all_of(borders.begin(), borders.end(), [&](int i) {
    if ((!events()[i].modes.empty() && !events()[i].is_edge) || borders_[i].farthest == 0) return false;
    const Expr sum = reach(i, allowed);
    return borders_[i].farthest <= state_.solution->values({&sum, 1}, point)[0];
  });
  return by_root || ((there.x - point.x).cwiseAbs().array() <= allowed.array()).all();
}

bool ModeTracker::slide_where_crossed(const Point& point, bool near) {
  constexpr long of_late = 100;  // steps
  std::vector<int> recent;
  for (std::size_t i = 0; i < borders_.size(); ++i)
    if (borders_[i].crossings > 0 && state_.stats().steps - borders_[i].last_step <= of_late)
      recent.push_back(static_cast<int>(i));
  return slide_along_one_of(recent, point, near);
}

/// Slides along all candidates or, failing that, along one.
bool ModeTracker::slide_along_one_of(const std::vector<int>& all, const Point& point, bool near) {
  const std::vector<int> candidates = near ? within_reach(all, point) : all;
  if (candidates.empty()) return false;
  const auto slides = [&](const std::vector<int>& which) {
    Point there = point;
    std::vector<int> done;
    bool tried = false;
    try {
      for (int i : which)
        if (slide(i, there)) done.push_back(i);
      tried = !done.empty();
    } catch (const UserFacing&) {
      if (done.empty()) throw;
      // moved onto one border, where its sides agree, the solution cannot slide along it without the next
    }
    if (tried && (!near || is_near(done, point, there))) {
      state_.stepper().start(there, state_.end);
      if (outside().empty()) return true;
    }
    for (int i : done) {
      borders_[i].treatment = Treatment::frozen;
      --borders_[i].slides;
    }
    if (!done.empty()) rebuild(point);
    return false;
  };
  return slides(candidates) ||
         std::any_of(candidates.begin(), candidates.end(), [&](int i) { return slides({i}); });
}

void ModeTracker::release(int which, int side, double t) {
  Border& border = borders_[which];
  border.treatment = Treatment::frozen;
  border.released = border.left = side;
  border.left_at = t;
  border.slid += t - border.since;
}

bool ModeTracker::has_just_left(const EventFinder::Hit& hit) {
  // of the step; on a tangent the solution is then 10⁻⁶ of its deviation from the border
  constexpr double behind = 1e-3;
  const Point &from = state_.view.from, &to = state_.view.to;
  if (hit.t - from.t > behind * (to.t - from.t)) return false;
  return std::all_of(hit.list.begin(), hit.list.end(), [&](const EventFinder::Crossing& crossing) {
    if (static_cast<std::size_t>(crossing.which) >= borders_.size()) return false;
    const Border& border = borders_[crossing.which];
    return border.left != 0 && border.left_at == from.t &&
           border.left * state_.finder.value(state_.stepper(), state_.view, crossing.which, to.t) > 0;
  });
}

/// Sliding borders whose μ is outside [0, 1] at the present point, or leaves it there, with the side to which
/// the solution leaves.
std::vector<std::pair<int, int>> ModeTracker::outside() const {
  constexpr double rounding = 1e-9;
  std::vector<std::pair<int, int>> result;
  if (weights_.empty()) return result;
  const Point& here = state_.stepper().here();
  state_.problem->set_point(here.t, here.x.data(), here.xdot.data(), here.z.data());
  const std::vector<double> mu =
      codegen::Kernel(weights_, state_.problem->arguments())(state_.problem->values());
  std::size_t next = 0;
  for (std::size_t i = 0; i < borders_.size(); ++i) {
    if (borders_[i].treatment != Treatment::sliding) continue;
    const double weight = mu[next++];
    const int side = weight < 0.5 ? 1 : -1;
    const double inside = side > 0 ? weight : 1 - weight;
    const int exit = static_cast<int>(*borders_[i].exits) + (side < 0);
    if (!(inside >= -rounding) || (inside <= rounding && state_.finder.slope(exit, here) < 0))
      result.emplace_back(static_cast<int>(i), side);
  }
  return result;
}

/// Functions that are positive while μ > 0 and while μ < 1. For μ = a/b they avoid the quotient, which has
/// a pole where both sides coincide: when the normal force of dry friction falls to 0, a and b change
/// their signs together.
static std::pair<Expr, Expr> bounds(Expr weight, const std::unordered_map<Expr, double>& values) {
  const bool negative = weight.op() == Op::neg;
  const Expr quotient = negative ? weight.operand(0) : weight;
  if (quotient.op() != Op::div) return {weight, Expr(1) - weight};
  const Expr a = negative ? -quotient.operand(0) : quotient.operand(0), b = quotient.operand(1);
  const double now = evaluate({&b, 1}, values)[0];
  if (!std::isfinite(now) || now == 0) return {weight, Expr(1) - weight};
  return now > 0 ? std::pair(a, b - a) : std::pair(-a, a - b);
}

/// Adds two events for every sliding border: μ < 0 and μ > 1. They keep their numbers after
/// sliding has ended.
void ModeTracker::renew_exits(const std::unordered_map<Expr, double>& values) {
  std::vector<Event>& list = state_.plan.events.list;
  const std::size_t before = list.size();
  std::size_t next = 0;
  bool renewed = false;
  for (std::size_t i = 0; i < borders_.size(); ++i) {
    if (borders_[i].treatment != Treatment::sliding) continue;
    if (!borders_[i].exits) {
      borders_[i].exits = list.size();
      list.resize(list.size() + 2);
    }
    const auto [above, below] = bounds(weights_[next++], values);
    for (int side : {1, -1}) {
      Event& exit = list[*borders_[i].exits + (side < 0)];
      exit.when = side > 0 ? above : below;
      exit.direction = dae::Direction::falling;
      exit.surface = true;
      exit.smoothness = Smoothness::kink;
      exit.exit = {static_cast<int>(i), side};
    }
    renewed = true;
  }
  if (renewed) {
    EventFinder finder(state_.problem, list);
    finder.take_over(state_.finder, before);
    state_.finder = std::move(finder);
  }
  for (std::size_t k = borders_.size(); k < list.size(); ++k)
    state_.finder.ignore(static_cast<int>(k), is_frozen(list[k].exit->surface));
}

}  // namespace pendula::integrate
