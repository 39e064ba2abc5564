// How a run ended.
#pragma once

#include <string>

#include "base/text.hpp"
#include "integrate/event/monitor/monitor.hpp"

namespace pendula::integrate {

enum class Ending {
  running,      ///< not yet
  finished,     ///< at `to`
  event,        ///< an event asked to stop
  stop_when,    ///< Plan::stop_when held
  regrowth,     ///< states have grown again from below their tolerances: simulate() repeats the run
  interrupted,  ///< Ctrl-C
  stopped       ///< it could not go on; the message says why
};

struct RunOutcome {
  Ending ending = Ending::running;
  std::string message;  ///< of `stopped`: "stopped at t = 0.98: why"
  double t = 0;         ///< of `stopped`

  /// The run has reached an end that was asked for.
  bool is_complete() const { return ending == Ending::finished || ending == Ending::event; }
  /// The text for users: the message, or the name of the ending.
  std::string text() const {
    switch (ending) {
      case Ending::running:
        return "running";
      case Ending::finished:
        return "finished";
      case Ending::event:
        return "event";
      case Ending::stop_when:
        return "left";
      case Ending::regrowth:
        return "to be repeated";
      case Ending::interrupted:
        return "interrupted";
      case Ending::stopped:
        break;
    }
    return message;
  }
};

/// "stopped at t = 0.98: why", the time with so many digits.
inline RunOutcome stopped_at(double t, const std::string& why, int digits = 6) {
  return {Ending::stopped, "stopped at t = " + rounded(t, digits) + ": " + why, t};
}
/// Times by interpolation between fixed steps have four digits.
inline RunOutcome stopped_at(const Stop& stop, int digits = 4) {
  return stopped_at(stop.t, stop.reason, digits);
}

}  // namespace pendula::integrate
