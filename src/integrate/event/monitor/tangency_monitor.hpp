// Divisors that a run has brought to zero within its tolerances without a change of sign.
//
// A spinning top passes the upright position, where two of its Euler angles become one: sin θ touches 0.
// Rounding and truncation errors turn the touch into a near miss; the continuation after it is arbitrary.
#pragma once

#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/events.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class TangencyMonitor : public Monitor {
 public:
  /// Monitors the events with a termination_reason; `finder` has evaluated them at the end of every step.
  /// Requires that events and finder outlive it.
  TangencyMonitor(const ProblemPtr& problem, const std::vector<Event>& events, const EventFinder& finder,
                  const Tolerances& tolerances);

  void start(const Point&) override { seen_.clear(); }
  void restart() override { seen_.clear(); }
  /// The event whose |g| had a minimum at the beginning of the step, below ten times its uncertainty there.
  std::optional<Stop> after(const MonitoredStep& step) override;

 private:
  struct Values {
    double largest = 0, before = 0, last = 0;
  };
  double uncertainty(std::size_t which, const Point& point);
  ProblemPtr problem_;
  const std::vector<Event>& events_;
  const EventFinder& finder_;
  const Tolerances& tolerances_;
  bool empty_;
  std::vector<Values> seen_;
  std::vector<codegen::Kernel> gradients_;  ///< with respect to (x, z), made when needed
};

}  // namespace pendula::integrate
