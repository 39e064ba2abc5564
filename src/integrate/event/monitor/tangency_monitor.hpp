// Divisors that a run has brought to zero within its tolerances without a change of sign.
//
// A spinning top passes the upright position, where two of its Euler angles become one: sin θ touches 0.
// Rounding and truncation errors turn the touch into a near miss; the continuation after it is arbitrary.
//
// Branches of 0 = z² - x² cross at x = 0: a step from one side to the other solves for z on the branch that
// it started on, by the sign of z, and not on the one that continues smoothly. z then turns at 0 between two
// mesh points, or inside a step that is longer than the distance between two crossings: where a divisor with
// z in it has turned, its least value is looked for between them.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/events.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class TangencyMonitor : public Monitor {
 public:
  /// Monitors the events with a termination_reason; `finder` has evaluated them at the end of every step.
  /// interval: of the run. Requires that events and finder outlive it.
  TangencyMonitor(const ProblemPtr& problem, const std::vector<Event>& events, const EventFinder& finder,
                  const Tolerances& tolerances, double interval);

  void start(const Point&) override { forget(); }
  void restart(const ProblemPtr& problem) override;
  /// The event whose |g| had a minimum at the beginning of the step, below ten times its
  /// uncertainty there, or that was 0 near it.
  std::optional<Stop> after(const MonitoredStep& step) override;

 private:
  void forget();
  struct Values {
    double largest = 0, before = 0, last = 0;
  };
  double value_at(std::size_t which, const Point& p);
  bool can_vanish(std::size_t which, const Point& point);
  std::optional<double> time_of_zero(std::size_t which, const MonitoredStep& step);
  std::optional<double> zero_inside(std::size_t which, const MonitoredStep& step, double before);
  std::optional<double> least_between(std::size_t which, const Point& from, const Point& to, double low,
                                      double high);
  std::optional<double> near_beginning(std::size_t which, const MonitoredStep& step, double share,
                                       double beyond, double first);
  double size_between(std::size_t which, const Point& from, const Point& to, double share);
  /// A point inside a step, with x′ and z; null where the equations have no solution.
  const Point* inside(const Point& from, const Point& to, double share);
  struct Inside {
    double from = 0, to = 0, share = 0;
    Point at;
    bool solved = false;
  };
  ProblemPtr given_, problem_;  ///< problem_: a copy, since the run sets other points
  const std::vector<Event>& events_;
  const EventFinder& finder_;
  const Tolerances& tolerances_;
  double interval_;
  bool empty_, any_with_z_ = false;
  std::vector<char> with_z_;  ///< z is in the condition
  Point previous_;            ///< two steps before the last point, if any has z
  bool has_previous_ = false;
  std::vector<Values> seen_;
  std::vector<std::pair<double, double>>
      inside_;                               ///< |g| at the last point inside the last step, and its share
  std::optional<double> begin_;              ///< of the run, if any has z
  std::vector<codegen::Kernel> conditions_;  ///< made when needed
  Stats ignored_;
  std::unique_ptr<RhsSolver> solver_;
  std::vector<Inside> known_;  ///< the points that were looked at after this step: all conditions share them
  std::size_t known_count_ = 0;
  std::vector<codegen::Kernel> gradients_;  ///< with respect to (x, z), made when needed
};

}  // namespace pendula::integrate
