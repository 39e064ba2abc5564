// Several events at one moment: those that resets set off.
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "integrate/run/event_handler.hpp"

namespace pendula::integrate {

constexpr double least_of_fastest = 1e-10;  // slopes of conditions: blows that send each other back end

/// The first event of direction ±2 whose condition is beyond its root where the run stands, or at it and on its way beyond.
/// happened: those that have at this time, at their roots: what rests there, as balls that touch, does so once.
std::optional<int> EventHandler::overdue(const std::vector<char>& happened, const AtRoots* roots,
                                         const Point& here) {
  const std::vector<Event>& events = state_.plan.events.list;
  for (std::size_t i = 0; i < events.size(); ++i) {
    if (std::abs(events[i].direction) < 2) continue;
    const double sign = events[i].direction > 0 ? 1 : -1, beyond = sign * state_.finder.values()[i];
    if (!roots && state_.finder.is_on_border(i) && happened[i]) continue;
    if (roots && !events[i].surface && is_at_root(i, here, roots->fastest)) {
      const double leaves = sign * state_.finder.slope(static_cast<int>(i), here);
      const double least = least_of_fastest * roots->fastest;
      if (leaves < -least || (leaves <= least && (happened[i] || events[i].stop))) continue;
      return static_cast<int>(i);
    }
    if (events[i].stop ? beyond > 0 : beyond >= 0) return static_cast<int>(i);
  }
  return {};
}

/// To rounding of times, and of what was solved for.
bool EventHandler::is_at_root(std::size_t i, const Point& point, double fastest) const {
  constexpr double close = 1e-12;  // of what a condition would change by in the time of the run
  const double size = fastest * std::max(state_.interval(), std::fabs(point.t));
  return std::fabs(state_.solution->values({&state_.plan.events.list[i].when, 1}, point)[0]) <= close * size;
}

EventHandler::AtRoots EventHandler::at_roots(const Point& before, const Point& here) {
  const std::vector<Event>& events = state_.plan.events.list;
  AtRoots roots{std::vector<double>(events.size(), NAN), std::vector<char>(events.size(), 0), {}, 0};
  roots.comes = roots.waits;
  for (int k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < events.size(); ++i) {
      const Event& event = events[i];
      if (event.surface || !event.termination_reason.empty() || event.direction == 0) continue;
      const double slope = state_.finder.slope(static_cast<int>(i), before);
      if (k == 0) {
        const double behind = state_.finder.slope(static_cast<int>(i), here);
        roots.fastest = std::max({roots.fastest, std::fabs(slope), std::fabs(behind)});
        continue;
      }
      if (!is_at_root(i, before, roots.fastest) || !is_at_root(i, here, roots.fastest)) continue;
      roots.slopes[i] = slope;
      // one that comes to its root at this very moment, and has not been found there, happens now
      const double moved = i < happened_.size() ? std::fabs(slope) * (here.t - happened_[i]) : NAN;
      roots.comes[i] = !(moved <= 1e-9 * roots.fastest * state_.interval());
      roots.waits[i] = roots.comes[i] || slope * event.direction < 0;  // or was on its way back
    }
  return roots;
}

/// The first event whose condition was at rest at its root, and leaves it in the event's direction since a reset: the third
/// ball of Newton's cradle touches the second, which the first has just hit.
std::optional<int> EventHandler::sent_across(AtRoots& roots, const Point& here, bool only_look) {
  constexpr double at_rest = 1e-6;  // of a slope behind the reset
  std::optional<int> first;
  for (std::size_t i = 0; i < roots.slopes.size(); ++i) {
    if (std::isnan(roots.slopes[i]) || std::abs(state_.plan.events.list[i].direction) != 1) continue;
    const double slope = state_.finder.slope(static_cast<int>(i), here);
    const bool leaves = slope * state_.plan.events.list[i].direction > least_of_fastest * roots.fastest;
    if (!leaves || std::fabs(roots.slopes[i]) <= at_rest * std::fabs(slope)) roots.waits[i] = 1;
    if (leaves && roots.waits[i] && !first) first = static_cast<int>(i);
  }
  if (only_look) return {};
  if (first) remark_order(*first, roots, here);
  if (first) roots.slopes[*first] = roots.fastest;  // it has left its root once
  if (first) roots.waits[*first] = 0;
  return first;
}

/// Of several events that are found at one moment the first reset may throw others back, which are then none.
bool EventHandler::is_thrown_back(const EventFinder::Crossing& crossing, const Point& here, double fastest) {
  const double slope = state_.finder.slope(crossing.which, here);
  return (crossing.rising ? -slope : slope) > least_of_fastest * fastest &&
         is_at_root(static_cast<std::size_t>(crossing.which), here, fastest);
}

std::string order_remark(double t, Expr when) {
  return text(
      "at t = ", rounded(t, 6), " the event ", to_text(when),
      " = 0 happens at the same moment as another one, which changes how it does: what comes of both may "
      "depend on their order, which is that of the list");
}

/// Of an event that was found at the same moment as one whose reset has changed its slope.
void EventHandler::remark_order(int which, AtRoots& roots, const Point& here) {
  constexpr double visible = 1e-6;  // false where the slope is not known
  const double was = roots.slopes[which], now = state_.finder.slope(which, here);
  const bool changed = std::fabs(now - was) > visible * roots.fastest;
  const bool came = roots.comes[which] && std::fabs(was) > visible * roots.fastest;
  roots.comes[which] = 0;
  if (changed && came && state_.solution->not_unique().empty())
    state_.solution->set_not_unique(order_remark(here.t, state_.plan.events.list[which].when));
}

bool EventHandler::settle(const Point* last, std::vector<EventFinder::Crossing> pending) {
  constexpr int most = 1000;  // events at one time
  std::optional<AtRoots> roots;
  std::vector<char> happened(state_.plan.events.list.size(), 0);
  for (int count = 0;; ++count) {
    if (state_.finder.empty()) return false;
    Point point = state_.stepper().here();
    if (last && !roots) roots = at_roots(*last, point);
    auto which = overdue(happened, roots ? &*roots : nullptr, point);
    const auto sent = roots ? sent_across(*roots, point, which || !pending.empty()) : std::nullopt;
    if (!pending.empty()) {
      which = pending.front().which;
      const bool is_none = roots && is_thrown_back(pending.front(), point, roots->fastest);
      if (roots) remark_order(*which, *roots, point);
      pending.erase(pending.begin());
      if (is_none) continue;
    }
    if (!which) which = sent;
    if (!which) return false;
    const Event& event = state_.plan.events.list[*which];
    if (count == most)
      throw Failure(text("at t = ", rounded(point.t, 8),
                         " events set each other off without end; one of them is ", to_text(event.when),
                         " = 0"));
    const Point before = point;
    const EventFinder::Crossing crossing{*which, event.direction > 0, 0};
    if (state_.finder.is_on_border(*which) || (roots && is_at_root(*which, point, roots->fastest)))
      happened[*which] = 1;
    state_.keep(point, true);
    const EventReply reply = apply(crossing, point);
    if (reply.stop) {
      write_records(point);
      return true;
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
