// Short visits to the other side of a border that is integrated through (event/surfaces.hpp).
//
// Crossings of such a border are not located, and the error estimate of a step sees its stages only:
// between two of them a diode may conduct and block again. A step that ends on the side where it
// began, but was on the other side in between, by more than its unknowns may err, is repeated with
// shorter steps until one ends there.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/run/adaptive_state.hpp"

namespace pendula::integrate {

class Excursions {
 public:
  /// Requires that the state outlives it.
  explicit Excursions(AdaptiveState& state) : state_(state) {}
  /// From now on these events are the borders that are integrated through.
  void watch(std::vector<char> unfrozen);
  /// Whether the step in state.view was on the other side of one of them. False, too, where more steps had to
  /// be repeated than were accepted: the solution then oscillates about the border within its tolerance.
  bool in_last_step();

 private:
  bool is_deep(int border);
  double uncertainty(int border);

  AdaptiveState& state_;
  std::vector<char> unfrozen_;  ///< of every event
  bool any_ = false;
  std::optional<EventFinder> finder_;
  std::map<int, codegen::Kernel> gradients_;  ///< by border, in x and z
  long repeated_ = 0;
};

}  // namespace pendula::integrate
