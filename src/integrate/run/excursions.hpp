// Short visits to the other side of a border that is integrated through (event/surfaces.hpp).
//
// Nothing locates the crossings of such a border, and the error estimate of a step knows its stages only: between
// two of them a diode may conduct and block again. A step that has been on the other side in between, and ends on the side
// where it began, is made again in shorter ones until one of them ends over there.
#pragma once

#include <optional>
#include <vector>

#include "integrate/run/adaptive_state.hpp"

namespace pendula::integrate {

class Excursions {
 public:
  /// Requires that the state outlives it.
  explicit Excursions(AdaptiveState& state) : state_(state) {}
  /// From now on these events are the borders that are integrated through.
  void watch(std::vector<char> thawed);
  /// Whether the step in state.view was on the other side of one of them. False, too, where more steps had to be
  /// repeated than were accepted: the solution then oscillates about the border within its tolerance.
  bool in_last_step();

 private:
  AdaptiveState& state_;
  std::vector<char> thawed_;  ///< of every event
  bool any_ = false;
  std::optional<EventFinder> finder_;
  long repeated_ = 0;
};

}  // namespace pendula::integrate
