// Several events at one time: those triggered by resets.
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "integrate/run/event_handler.hpp"

namespace pendula::integrate {

/// The first event that counts beyond its root (dae::Direction) whose condition is there at the present
/// point, or at the root and about to cross it. happened: events of this time with their condition at the
/// root; an event that stays there, as for bodies in contact, happens once. idle: events that have happened
/// without changing anything.
std::optional<int> EventHandler::overdue(const std::vector<char>& happened, const std::vector<char>& idle,
                                         const AtRoots* roots, const Point& here) {
  const std::vector<Event>& events = state_.plan.events.list;
  for (std::size_t i = 0; i < events.size(); ++i) {
    if (!dae::counts_beyond(events[i].direction) || idle[i]) continue;
    const double sign = dae::sign_of_slope(events[i].direction), beyond = sign * state_.finder.values()[i];
    if (!roots && state_.finder.is_on_border(i) && happened[i]) continue;
    if (roots && !events[i].surface && is_at_root(i, here, roots->fastest())) {
      const double leaves = sign * state_.finder.slope(static_cast<int>(i), here);
      if (roots->is_leaving(-leaves) || (!roots->is_leaving(leaves) && (happened[i] || events[i].stop)))
        continue;
      return static_cast<int>(i);
    }
    if (events[i].stop ? beyond > 0 : beyond >= 0) return static_cast<int>(i);
  }
  return {};
}

/// Is the condition zero to within rounding of the time and of the solved unknowns?
bool EventHandler::is_at_root(std::size_t i, const Point& point, double fastest) const {
  constexpr double close = 1e-12;  // relative to the change of the fastest condition over the run
  const double size = fastest * std::max(state_.interval(), std::fabs(point.t));
  return std::fabs(state_.solution->values({&state_.plan.events.list[i].when, 1}, point)[0]) <= close * size;
}

AtRoots EventHandler::at_roots(const Point& before, const Point& here) {
  const std::vector<Event>& events = state_.plan.events.list;
  std::vector<dae::Direction> directions;
  std::vector<int> asked;
  for (std::size_t i = 0; i < events.size(); ++i) {
    directions.push_back(events[i].direction);
    if (!events[i].surface && events[i].termination_reason.empty() &&
        events[i].direction != dae::Direction::both)
      asked.push_back(static_cast<int>(i));
  }
  AtRoots roots(directions);
  for (int i : asked)
    for (const Point* point : {&before, &here}) roots.measure(state_.finder.slope(i, *point));
  for (int i : asked) {
    const auto k = static_cast<std::size_t>(i);
    if (!is_at_root(k, before, roots.fastest()) || !is_at_root(k, here, roots.fastest())) continue;
    const double since = k < happened_.size() ? here.t - happened_[k] : NAN;
    roots.add(k, state_.finder.slope(i, before), since, state_.interval());
  }
  return roots;
}

/// Among simultaneous events, has the first reset reversed the motion of another one, which then
/// does not happen?
bool EventHandler::is_thrown_back(const EventFinder::Crossing& crossing, const Point& here,
                                  const AtRoots& roots) {
  const double slope = state_.finder.slope(crossing.which, here);
  return roots.is_leaving(crossing.rising ? -slope : slope) &&
         is_at_root(static_cast<std::size_t>(crossing.which), here, roots.fastest());
}

void EventHandler::remark_order(int which, double t) {
  if (state_.solution->not_unique().empty())
    state_.solution->set_not_unique(order_remark(t, state_.plan.events.list[which].when));
}

bool EventHandler::settle(const Point* last, std::vector<EventFinder::Crossing> pending) {
  constexpr int most = 1000;  // events at one time
  std::optional<AtRoots> roots;
  std::vector<char> happened(state_.plan.events.list.size(), 0), idle = happened;
  for (int count = 0;; ++count) {
    if (state_.finder.empty()) return false;
    Point point = state_.stepper().here();
    if (last && !roots) roots = at_roots(*last, point);
    auto which = overdue(happened, idle, roots ? &*roots : nullptr, point);
    const auto slope = [&](int i) { return state_.finder.slope(i, point); };
    if (roots && (which || !pending.empty())) roots->update(slope);
    const bool found = !pending.empty();
    bool rising = false;
    if (found) {
      which = pending.front().which;
      rising = pending.front().rising;
      const bool is_none = roots && is_thrown_back(pending.front(), point, *roots);
      if (roots && roots->order_matters(*which, slope(*which))) remark_order(*which, point.t);
      pending.erase(pending.begin());
      if (is_none) continue;
    } else if (!which && roots) {
      if (const auto triggered = roots->first_triggered(slope)) {
        which = triggered->which;
        if (triggered->order_matters) remark_order(*which, point.t);
      }
    }
    if (!which) return false;
    const Event& event = state_.plan.events.list[*which];
    if (count == most)
      throw Failure(text("at t = ", rounded(point.t, 8),
                         " events set each other off without end; one of them is ", to_text(event.when),
                         " = 0"));
    const Point before = point;
    const EventFinder::Crossing crossing{*which, found ? rising : dae::sign_of_slope(event.direction) > 0, 0};
    if (state_.finder.is_on_border(*which) || (roots && is_at_root(*which, point, roots->fastest())))
      happened[*which] = 1;
    state_.keep(point, true);
    const EventReply reply = apply(crossing, point);
    if (reply.stop) {
      write_records(point);
      return true;
    }
    if (reply.reset.empty() && found) {
      write_records(point);
      idle[*which] = 1;
      continue;
    }
    if (reply.reset.empty()) {
      records_.clear();
      return false;
    }
    restart(point, before, {point.t, point.t, {crossing}}, Moment::same);
    point = state_.stepper().here();
    state_.history->begin(point);
    state_.writer.begin(point);
    write_records(point);
  }
}

}  // namespace pendula::integrate
