// Expressions that must not vanish, and that a run has brought to zero within its tolerances without crossing
// it.
//
// A top goes upright, two coordinates of Euler angles become one: sin θ touches 0. Rounding and truncation
// make a near miss of it, the step size control resolves that as if it were one, and what comes behind is
// chance.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/events.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class TouchWatch {
 public:
  /// Looks at the events with `ends`. Requires problem and events to outlive it.
  TouchWatch(const ProblemPtr& problem, const std::vector<Event>& events)
      : problem_(problem), events_(events) {}

  /// After every step: g of every event at its end, and the point it began at. What has turned back to where
  /// it came from at that point, nearer to zero than ten tolerances of what it is made of: which, and how
  /// near.
  struct Hit {
    int which;
    double distance;
  };
  std::optional<Hit> after(const std::vector<double>& g, const Point& before, const Tolerances& tolerances);
  void forget() { last_.clear(); }

 private:
  struct Seen {
    double largest = 0, before = 0, last = 0;
  };
  double uncertainty(std::size_t which, const Point& point, const Tolerances& tolerances);
  ProblemPtr problem_;
  const std::vector<Event>& events_;
  std::vector<Seen> last_;
  std::vector<codegen::Kernel> gradients_;  ///< with respect to (x, z), made when needed
};

}  // namespace pendula::integrate
