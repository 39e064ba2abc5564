#include "integrate/event/at_roots.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {

AtRoots::AtRoots(std::vector<dae::Direction> directions)
    : directions_(std::move(directions)),
      slopes_(directions_.size(), NAN),
      may_leave_(directions_.size(), 0),
      has_arrived_(directions_.size(), 0) {}

void AtRoots::measure(double slope) {
  if (std::isfinite(slope)) fastest_ = std::max(fastest_, std::fabs(slope));
}

bool AtRoots::is_leaving(double slope) const {
  constexpr double least = 1e-10;  // relative to the fastest slope
  return slope > least * fastest_;
}

void AtRoots::add(std::size_t i, double slope, double since, double interval) {
  constexpr double at_this_moment = 1e-9;  // relative to a change at the fastest slope over the run
  slopes_[i] = slope;
  has_arrived_[i] = !(std::fabs(slope) * since <= at_this_moment * fastest_ * interval);
  may_leave_[i] =
      has_arrived_[i] || slope * dae::sign_of_slope(directions_[i]) < 0;  // or it was returning to its root
}

bool AtRoots::order_matters(int which, double now) {
  constexpr double visible = 1e-6;  // the comparisons below are false where a slope is unknown (NaN)
  const double was = slopes_[which];
  const bool came = has_arrived_[which] && std::fabs(was) > visible * fastest_;
  has_arrived_[which] = 0;
  return came && std::fabs(now - was) > visible * fastest_;
}

std::optional<int> AtRoots::first_leaving(const Slope& now) {
  constexpr double at_rest = 1e-6;  // relative to the slope after the reset
  std::optional<int> first;
  for (std::size_t i = 0; i < slopes_.size(); ++i) {
    if (std::isnan(slopes_[i]) || !dae::is_strict(directions_[i])) continue;
    const double slope = now(static_cast<int>(i));
    const bool leaves = is_leaving(slope * dae::sign_of_slope(directions_[i]));
    if (!leaves || std::fabs(slopes_[i]) <= at_rest * std::fabs(slope)) may_leave_[i] = 1;
    if (leaves && may_leave_[i] && !first) first = static_cast<int>(i);
  }
  return first;
}

std::optional<AtRoots::Triggered> AtRoots::first_triggered(const Slope& now) {
  const auto first = first_leaving(now);
  if (!first) return {};
  const Triggered triggered{*first, order_matters(*first, now(*first))};
  slopes_[triggered.which] = fastest_;  // counts as having left its root
  may_leave_[triggered.which] = 0;
  return triggered;
}

std::optional<std::vector<Expr>> states_behind(Expr when, const dae::FirstOrder& form) {
  const auto place = [](const std::vector<Expr>& list, Expr leaf) {
    return std::find(list.begin(), list.end(), leaf);
  };
  std::vector<Expr> states;
  // collects the states among the leaves; false if there are z, or derivatives other than `own`
  const auto collect = [&](Expr e, Expr own) {
    for (Expr leaf : leaves({&e, 1})) {
      if (place(form.z, leaf) != form.z.end()) return false;
      if (leaf != own && place(form.xdot, leaf) != form.xdot.end()) return false;
      if (place(form.x, leaf) != form.x.end()) states.push_back(leaf);
    }
    return true;
  };
  if (!collect(when, {})) return {};
  for (Expr x : std::vector<Expr>(states)) {
    const Expr slope = form.xdot.begin()[place(form.x, x) - form.x.begin()];
    for (Expr row : form.F) {
      const std::vector<Expr> inside = leaves({&row, 1});
      if (place(inside, slope) != inside.end() && !collect(row, slope)) return {};
    }
  }
  const auto by_id = [](Expr a, Expr b) { return a.id() < b.id(); };
  std::sort(states.begin(), states.end(), by_id);
  states.erase(std::unique(states.begin(), states.end()), states.end());
  return states;
}

std::string order_remark(double t, Expr when) {
  return text("at t = ", rounded(t, 6), " the event ", to_text(when),
              " = 0 happens at the same moment as another one, which changes its slope: the result may "
              "depend on their order, which is that of the list");
}

}  // namespace pendula::integrate
