// Times at which inputs are not smooth: steps end there, and the run goes on with the values behind them.
#pragma once

#include "integrate/run/event_handler.hpp"

namespace pendula::integrate {

class InputBreaks {
 public:
  InputBreaks(AdaptiveState& state, EventHandler& events) : state_(state), events_(events) {}

  /// A step over a jump or kink of a monitored input is taken back; the next ones end there.
  bool has_repeated_step();
  /// Has the step size shrunk in front of a jump? Where an unknown jumps with an input, no step across it has
  /// a small error; steps become shorter until the last point is at the jump, and the run goes on after it.
  bool has_jumped_to_next(const Point& here);
  /// Goes on after a time at which inputs are not smooth, with the same step size. True
  /// where an event ends the run there.
  bool pass();
  /// Is there a break at `to`?
  bool are_at_end() const;
  /// Inputs that jump at `to` have their new values there, as at any other time.
  void arrive();

 private:
  std::optional<double> first_between(double from, double to, bool at_break);
  double shortest_part(double t) const;

  AdaptiveState& state_;
  EventHandler& events_;
  std::vector<double> sizes_;  ///< of the monitored inputs: the largest so far
};

}  // namespace pendula::integrate
