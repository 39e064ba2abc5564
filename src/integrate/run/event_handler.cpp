#include "integrate/run/event_handler.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

bool contains_condition(Expr e) {
  const std::vector<Expr> nodes = topological({&e, 1});
  return std::any_of(nodes.begin(), nodes.end(), [](Expr node) {
    return node.op() == Op::ifelse || node.op() == Op::sign || node.op() == Op::lt || node.op() == Op::le;
  });
}

}  // namespace

bool EventHandler::after_step(RunOutcome& outcome) {
  for (first_in_step_ = true; !state_.finder.empty(); first_in_step_ = false) {
    std::optional<EventFinder::Hit> hit;
    try {
      hit = state_.finder.find(state_.stepper(), state_.view);
    } catch (const Oscillation&) {
      throw;
    } catch (const Failure&) {  // no z inside the step: it has crossed a singular point
      if (state_.plan.guards.empty() || !first_in_step_ || !repeated_shorter()) throw;
      return true;
    }
    if (!hit) return begins_on_chosen_side();
    if (drop_jumps(*hit)) continue;
    if (modes_.has_just_left(*hit)) {
      state_.finder.pass(*hit, state_.stepper(), state_.view);
      continue;
    }
    if (handle(*hit, outcome)) return true;
  }
  return false;
}

/// The step has shown on which side of a border it goes on, or that neither takes it: it is made anew.
bool EventHandler::begins_on_chosen_side() {
  if (state_.plan.modes == 0) return false;
  const Point before = state_.stepper().before();
  const bool chosen = modes_.has_chosen_side(before);
  if (!chosen && !(first_in_step_ && modes_.slides_from_start(before))) return false;
  begin_again(chosen ? before : Point(state_.stepper().here()), {});
  return true;
}

/// Removes factors that change their sign by a jump. Together with their branches they vanish nowhere, like
/// {-1 if t < 1, else 1}, or on the border only, like sign(t - 1). Returns true if no other event remains.
bool EventHandler::drop_jumps(EventFinder::Hit& hit) {
  constexpr double eps = std::numeric_limits<double>::epsilon();
  // relative to the factor at the ends of the step; at a root the ratio is 1e-6 or less
  constexpr double close = 1e-3;
  const auto size = [&](int which, double t) {
    return std::fabs(state_.finder.value(state_.stepper(), state_.view, which, t));
  };
  const EventFinder::Hit all = hit;
  std::erase_if(hit.list, [&](const EventFinder::Crossing& crossing) {
    const int which = crossing.which;
    if (event_of(crossing).termination_reason.empty() || !contains_condition(event_of(crossing).when))
      return false;
    const double usual = std::min(size(which, state_.view.from.t), size(which, state_.view.to.t));
    const double behind = hit.t + std::max(hit.t - hit.before, 4 * eps * std::fabs(hit.t));
    return size(which, hit.before) > close * usual && size(which, behind) > close * usual;
  });
  if (!hit.list.empty()) return false;
  state_.finder.pass(all, state_.stepper(), state_.view);
  return true;
}

const Event* EventHandler::terminating(const EventFinder::Hit& hit) const {
  for (const auto& crossing : hit.list)
    if (!event_of(crossing).termination_reason.empty()) return &event_of(crossing);
  return nullptr;
}

/// Applies simultaneous events together if their resets do not affect the conditions of the others, as
/// for synchronous clocks. Other events with resets stay pending until the restart shows the effects of
/// the first resets.
EventHandler::Applied EventHandler::apply_all(const EventFinder::Hit& hit, Point& point) {
  Applied done;
  std::vector<Expr> reset;
  for (const auto& crossing : hit.list) {
    if (event_of(crossing).surface) continue;
    if (done.changed && !done.stop && may_reset(crossing) && may_change(crossing.which, reset)) {
      done.pending.push_back(crossing);
      continue;
    }
    const EventReply reply = apply(crossing, point);
    done.stop = done.stop || reply.stop;
    done.changed = done.changed || !reply.reset.empty();
    for (const auto& [state, value] : reply.reset) reset.push_back(state);
  }
  return done;
}

/// Can a change of these states change the condition of the event or its slope?
bool EventHandler::may_change(int which, const std::vector<Expr>& reset) {
  // restoring the conditions on the states changes other states as well
  if (state_.plan.events.reinitialise) return true;
  if (behind_.empty())
    for (const Event& event : state_.plan.events.list)
      behind_.push_back(states_behind(event.when, state_.problem->model()));
  const auto& behind = behind_[which];
  return !behind || std::any_of(reset.begin(), reset.end(), [&](Expr state) {
    return std::find(behind->begin(), behind->end(), state) != behind->end();
  });
}

/// Returns true if the step ends at the event or was rejected.
bool EventHandler::handle(const EventFinder::Hit& hit, RunOutcome& outcome) {
  AdaptiveState& s = state_;
  if (const Event* end = terminating(hit)) return end_before(hit, *end, outcome);
  bool surface = false, may_jump = false, frozen = true, beyond = false;
  for (const auto& crossing : hit.list) {
    const Event& event = event_of(crossing);
    surface = surface || event.surface;
    frozen = frozen && (!event.surface || !event.modes.empty());
    beyond = beyond || (event.surface && event.modes.empty() && !event.exit);
    may_jump = may_jump || event.call || !event.reset.empty();
  }
  // an unfrozen branch was evaluated beyond its border; the step must end at the border
  if (beyond && first_in_step_ && repeated_up_to(hit.t)) return true;
  Point point = point_of(hit, surface && !frozen);
  if (surface && repeated_for_doubt()) return true;
  if (is_contradictory(hit, point)) {
    if (s.finder.rests(hit, s.stepper(), s.view)) return false;
    if (first_in_step_ && repeated_shorter()) return true;
    const bool soon = !last_restart_.list.empty() && point.t - last_restart_.t < brief * s.interval();
    if (soon) {
      s.reached = s.view.from.t;
      throw accumulation(event_of(hit.list.front()));
    }
  }
  // evaluate just before the border: sign(x) is 0 on the border only
  const auto is_divisor = [](const Event& event) { return !event.termination_reason.empty(); };
  if (surface && !may_jump && std::any_of(s.plan.events.list.begin(), s.plan.events.list.end(), is_divisor))
    if (const auto gone = s.finder.vanished(s.inside(hit.before, Detail::full)))
      return end_before(hit, s.plan.events.list[*gone], outcome);
  // the rest of the interval is no step if it is as short as the uncertainty of event times
  constexpr double uncertain = 100 * std::numeric_limits<double>::epsilon();
  const bool at_end = s.plan.to - hit.t <= uncertain * std::fabs(s.plan.to);
  point.t = at_end ? s.plan.to : hit.t;
  // where the equations are about to lose rank on the border, the step may have found another root
  if (surface && first_in_step_ && s.plan.stop_when && s.plan.stop_when(point)) {
    outcome.ending = Ending::stop_when;
    return true;
  }
  s.keep(point, may_jump || surface);
  const Point before = point;
  bool settle_after = false;
  const std::vector<double> sides = this->sides();
  auto [stop, changed, pending] = apply_all(hit, point);
  bool begun = false;
  if (!stop && (changed || (surface && !at_end))) {
    restart(point, before, hit);
    begun = true;
  } else if (!stop && surface) {
    begun = arrives(point, before, hit);
  }
  if (changed) {
    if (!stop) point = s.stepper().here();
    s.history->begin(point);
    s.writer.begin(point);
    settle_after = !stop;
  } else if (begun) {
    s.go_on(before);
    pending = carried_across(sides, hit);
    settle_after = !pending.empty();
  } else {
    s.writer.go_on(point, false);  // was withheld, but nothing has jumped
  }
  write_records(point);
  if (settle_after && settle(&before, pending)) stop = true;
  if (stop) outcome.ending = Ending::event;
  if (!stop && at_end) outcome.ending = Ending::finished;
  const bool ends_step = stop || changed || surface || at_end;
  if (!ends_step) s.finder.pass(hit, s.stepper(), s.view);
  return ends_step;
}

/// At the time of a hit, or just before it: on demand, and where the equations have no value on a border
/// itself, sin(s)/s at s = 0; then so far before it that rounding does not hide it.
Point EventHandler::point_of(const EventFinder::Hit& hit, bool before) {
  constexpr int most = 6;  // looks
  double back = before ? hit.t - hit.before : 0;
  for (int k = 0; k < most; ++k) {
    try {
      return state_.inside(hit.t - back, Detail::full);
    } catch (const UndefinedEquations&) {
      back = back == 0 ? hit.t - hit.before : 4 * back;
    }
  }
  return state_.inside(std::max(hit.t - back, state_.view.from.t), Detail::full);
}

std::vector<double> EventHandler::sides() const {
  std::vector<double> sides;
  for (std::size_t i = 0; i < state_.plan.events.list.size(); ++i)
    sides.push_back(state_.finder.side(static_cast<int>(i)));
  return sides;
}

bool EventHandler::settle_carried(const Point& before, const std::vector<double>& sides) {
  std::vector<EventFinder::Crossing> list = carried_across(sides);
  return !list.empty() && settle(&before, std::move(list));
}

/// Events whose conditions have jumped across zero, such as contact forces where friction reverses.
std::vector<EventFinder::Crossing> EventHandler::carried_across(const std::vector<double>& before,
                                                                const EventFinder::Hit& hit) const {
  std::vector<EventFinder::Crossing> list;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Event& event = state_.plan.events.list[i];
    const int which = static_cast<int>(i);
    const double now = state_.finder.side(which);
    if (event.surface || !event.termination_reason.empty() || before[i] * now >= 0 ||
        dae::sign_of_slope(event.direction) * now < 0)
      continue;
    if (std::none_of(hit.list.begin(), hit.list.end(), [&](const auto& c) { return c.which == which; }))
      list.push_back({which, now > 0});
  }
  return list;
}

/// Does the condition fall by the continuous extension but rise by the equations, or the reverse? If a reset
/// depends on it, the errors of the step exceed the motion since the last event.
bool EventHandler::is_contradictory(const EventFinder::Hit& hit, const Point& point) {
  for (const auto& crossing : hit.list) {
    const Event& event = event_of(crossing);
    if (event.surface || (event.reset.empty() && !event.call)) continue;
    const double slope = state_.finder.slope(crossing.which, point);
    if (crossing.rising ? slope < 0 : slope > 0) return true;
  }
  return false;
}

void EventHandler::write_records(const Point& after) {
  for (EventRecord& record : records_) {
    if (record.action == "reset") record.after = after;
    state_.solution->add_event(record);
  }
  records_.clear();
}

/// Ends the run at an event where the equations become singular. A long step is repeated in shorter ones
/// first, since interpolation across a singular point is unreliable. Otherwise the solution ends at the
/// beginning of the step, or just before the event if other events preceded it in the step.
bool EventHandler::end_before(const EventFinder::Hit& hit, const Event& event, RunOutcome& outcome) {
  const bool is_long = state_.view.to.t - state_.view.from.t > brief * state_.interval();
  if (first_in_step_ && is_long && repeated_shorter()) return true;
  if (!first_in_step_) {
    Point point = state_.inside(hit.before, Detail::state);
    point.t = hit.before;
    state_.keep(point, false);
  }
  outcome = stopped_at(hit.t, event.termination_reason);
  return true;
}

bool EventHandler::repeated_shorter() {
  const double dt = (state_.stepper().here().t - state_.stepper().before().t) / 4;
  return dt >= shortest_repeated * state_.interval() && repeated(dt);
}

/// The last interpolated point is not as accurate as its step: shorter ones, or its error counts.
bool EventHandler::repeated_for_doubt() {
  if (!state_.stepper().is_doubtful()) return false;
  if (first_in_step_ && repeated_shorter()) return true;
  state_.stats().errors += state_.stepper().error_inside();
  return false;
}

bool EventHandler::is_defined(const Point& point) const {
  Problem& problem = *state_.problem;
  problem.set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  std::vector<double> residual(static_cast<std::size_t>(problem.n() + problem.m()));
  problem.residual(residual.data());
  return std::all_of(residual.begin(), residual.end(), [](double r) { return std::isfinite(r); });
}

bool EventHandler::repeated_until(double t) {
  const double from = state_.stepper().before().t;
  if (t - from <= no_time * state_.interval()) return false;
  state_.end = t;
  return repeated(t - from);
}

bool EventHandler::repeated_up_to(double t) {
  constexpr double at_the_end = 1e-6;  // of a step
  const double from = state_.view.from.t, to = state_.view.to.t;
  if (to - t <= at_the_end * (to - from) || t - from <= no_time * state_.interval()) return false;
  if (!is_defined(state_.inside(t, Detail::full))) return false;  // x log|x| is undefined at 0 itself
  state_.end = t;
  return repeated(t - from);
}

bool EventHandler::repeated(double dt) {
  Stepper& stepper = state_.stepper();
  const Point start = stepper.before();
  --state_.stats().steps;
  ++state_.stats().rejected;
  const std::vector<Event>& events = state_.plan.events.list;
  const ModeTracker::Crossings after =
      last_restart_.t == start.t ? last_restart_.list : ModeTracker::Crossings{};
  std::vector<double> sides;
  state_.finder.start(start, after);
  for (std::size_t i = 0; i < events.size(); ++i) sides.push_back(state_.finder.side(static_cast<int>(i)));
  stepper.suggest(dt);
  stepper.start(start, state_.end);
  stepper.suggest(0);
  state_.finder.start(stepper.here(), after);
  for (std::size_t i = 0; i < sides.size(); ++i) {  // solving for z again may lead to another solution
    const bool ends = !events[i].termination_reason.empty();
    if (ends && sides[i] * state_.finder.side(static_cast<int>(i)) < 0) return false;
  }
  return true;
}

/// Applies the reset or callback of an event to the point.
EventReply EventHandler::apply(const EventFinder::Crossing& crossing, Point& point) {
  const Event& event = event_of(crossing);
  const auto which = static_cast<std::size_t>(crossing.which);
  if (happened_.size() <= which) happened_.resize(which + 1, -std::numeric_limits<double>::infinity());
  happened_[which] = point.t;
  EventReply reply;
  if (event.call) reply = event.call(point);
  for (const auto& [state, value] : event.reset)
    reply.reset.emplace_back(state, state_.solution->values({&value, 1}, point)[0]);
  reply.stop = reply.stop || event.stop;
  const char* action = reply.stop ? "stop" : reply.reset.empty() ? "" : "reset";
  records_.push_back({point.t, crossing.which, action, point, point});
  if (!reply.reset.empty()) reset(point, reply.reset);
  return reply;
}

void EventHandler::reset(Point& point, const std::vector<std::pair<Expr, double>>& values) {
  std::vector<int> changed;
  for (const auto& [state, value] : values) {
    const auto& x = state_.problem->model().x;
    const auto at = std::find(x.begin(), x.end(), state);
    if (at == x.end())
      throw Error(text("an event cannot reset ", to_text(state), ": it is not a state of the model",
                       x.size() <= 12 ? text(" (its states: ", dae::names_of(x), ")") : ""));
    if (!std::isfinite(value)) throw Failure(text("an event resets ", to_text(state), " to ", value));
    changed.push_back(static_cast<int>(at - x.begin()));
    point.x[changed.back()] = value;
  }
  if (state_.plan.events.reinitialise) state_.plan.events.reinitialise(point, changed);
}

void EventHandler::restart(const Point& point, const Point& before, const EventFinder::Hit& hit,
                           Moment moment) {
  last_restart_ = hit;
  last_restart_.t = point.t;
  modes_.count(hit.list, point);
  Point from = point;
  if (moment == Moment::later) check_accumulation(from, hit);
  // if x′ is continuous, so are its derivatives with respect to the parameters
  const bool follows = state_.problem->n() > state_.problem->visible_n() && !modes_.is_continuous(hit.list);
  const double slope = follows ? state_.finder.slope(hit.list.front().which, before) : 0;
  begin_again(from, hit.list);
  if (follows) follow_sensitivities(before, hit, slope);
}

/// Restarts at the end of the run. If no solution exists beyond the border, the values before it are kept.
bool EventHandler::arrives(const Point& point, const Point& before, const EventFinder::Hit& hit) {
  try {
    restart(point, before, hit);
    return true;
  } catch (const Failure&) {
    return false;
  }
}

void EventHandler::check_accumulation(Point& point, const EventFinder::Hit& hit) {
  ++since_event_;
  for (const EventFinder::Crossing& crossing : hit.list)
    if (!event_of(crossing).surface) {
      since_event_ = 0;
      last_event_ = crossing.which;
    }
  if (!zeno_.add(point.t, state_.stats().steps, state_.interval())) return;
  // Solutions of v′ = -g - v |v| cross v = 0 between bounces, but it is the bounces that accumulate.
  const int which = last_event_ && since_event_ <= 2 ? *last_event_ : hit.list.front().which;
  const Event event = state_.plan.events.list[which];  // the list may grow
  const bool again = point.t - last_accumulation_ < brief * state_.interval();
  // once for each border, however many accumulate together
  const bool unfrozen = event.surface && modes_.unfreeze(hit.list, point);
  const bool slides = event.surface && !again && !unfrozen && modes_.slide_where_crossed(point);
  if (slides) point = state_.stepper().here();  // moved onto the borders
  if (unfrozen || slides) {
    last_accumulation_ = point.t;
    zeno_ = {};
    return;
  }
  state_.reached = point.t;
  if (event.surface) throw modes_.chattering(event);
  throw accumulation(event);
}

Failure EventHandler::accumulation(const Event& event) const {
  return Failure(text("the events ", to_text(event.when),
                      " = 0 accumulate: infinitely many in finite time (Zeno). Add an event that stops, or a "
                      "reset that ends the motion"));
}

void EventHandler::begin_again(const Point& point, const ModeTracker::Crossings& crossed) {
  modes_.begin(point, crossed);
  monitors_.restart(state_.problem);
  const Plan& plan = state_.plan;
  const bool may_jump = plan.modes > 0 || !plan.breaks.empty() || !plan.monitored_inputs.empty();
  if (may_jump) state_.history->begin(state_.stepper().here());
}

/// The time t* of an event depends on p: dt*/dp = -(dg/dp)/(dg/dt). Therefore S jumps where x or x′ jumps: S₊
/// = S₋ + (x′₋ - x′₊) dt*/dp; for a reset x₊ = r(t, x): S₊ = dr/dp + (dr/dt - x′₊) dt*/dp.
/// see  Galán, Feehery & Barton, Appl. Numer. Math. 31, 1999;  docs/derivations.md#sensitivities
void EventHandler::follow_sensitivities(const Point& before, const EventFinder::Hit& hit, double slope) {
  const Event& event = event_of(hit.list.front());
  const Solution& solution = *state_.solution;
  const Vec tangent = solution.values(event.tangent, before);
  if (slope == 0)
    throw Failure(text("the solution grazes ", to_text(event.when), " = 0: it is not differentiable there"));
  Point after = state_.stepper().here();
  const int n = state_.problem->visible_n();
  const auto& x = state_.problem->model().x;
  for (Eigen::Index j = 0; j < tangent.size(); ++j) {
    const double shift = -tangent[j] / slope;
    const auto block = static_cast<Eigen::Index>(n) * (j + 1);
    after.x.segment(block, n) =
        before.x.segment(block, n) + shift * (before.xdot.head(n) - after.xdot.head(n));
    for (std::size_t r = 0; r < event.reset.size(); ++r) {
      const auto i = std::find(x.begin(), x.end(), event.reset[r].first) - x.begin();
      const Vec rates = solution.values(event.reset_tangent[r], before);
      after.x[block + i] = rates[j] + shift * (rates[rates.size() - 1] - after.xdot[i]);
    }
  }
  begin_again(after, hit.list);
}

}  // namespace pendula::integrate
