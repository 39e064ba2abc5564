// Conditions of events that are at their roots when the first of several simultaneous resets
// happens, and which of them the resets send across. The third ball of Newton's cradle touches the
// second, which the first has just hit.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dae/model/first_order.hpp"

namespace pendula::integrate {

class AtRoots {
 public:
  /// d condition/dt where the run stands, by the number of its event; 0 or not a
  /// number where it is not known.
  using Slope = std::function<double(int)>;
  struct Triggered {
    int which;
    bool order_matters;
  };

  /// The events by their directions, none of them at its root yet.
  explicit AtRoots(std::vector<dae::Direction> directions);

  void measure(double slope);  ///< one that others are measured by
  double fastest() const { return fastest_; }
  bool is_leaving(double slope) const;  ///< visibly: impacts that send each other back end

  /// Adds event i, whose condition is at its root before and after the resets. slope: before
  /// them; since: time since the event happened, or not a number; interval: of the run. To be
  /// called after all measurements.
  void add(std::size_t i, double slope, double since, double interval);

  /// Has a reset changed the slope of an event that reached its root at this very
  /// moment? Called once for each.
  bool order_matters(int which, double now);
  /// Registers the slopes since the last reset.
  void update(const Slope& now) { first_leaving(now); }
  /// The same, and the first event that leaves its root in its direction after it
  /// was at rest there or moved back.
  std::optional<Triggered> first_triggered(const Slope& now);

 private:
  std::optional<int> first_leaving(const Slope& now);
  std::vector<dae::Direction> directions_;
  std::vector<double> slopes_;     ///< before the resets; NaN: not at a root
  std::vector<char> may_leave_;    ///< has since been at rest, or on the side that the event comes from
  std::vector<char> has_arrived_;  ///< has come to its root at this moment, and not happened since
  double fastest_ = 0;
};

/// The states that a condition and its slope depend on, by the equations of these states as they are
/// written, ascending by id; nothing where these equations contain other unknowns, which may depend on
/// every state. Cost: linear in them.
std::optional<std::vector<Expr>> states_behind(Expr when, const dae::FirstOrder& form);

/// That what comes of events at one moment may depend on their order.
std::string order_remark(double t, Expr when);

}  // namespace pendula::integrate
