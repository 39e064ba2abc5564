// Divisors that must not vanish along a solution, after steps of a fixed size.
#pragma once

#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/event/monitor/rank_monitor.hpp"

namespace pendula::integrate {

/// A sign that differs from the one before is a zero in between; so is a value that, by the slopes at both
/// ends, had a minimum in between and reached zero there to 1e-9 of its values at the ends.
class SingularityMonitor : public Monitor {
 public:
  /// Requires that the guards outlive it.
  SingularityMonitor(const ProblemPtr& problem, const std::vector<Guard>& guards);
  void start(const Point& point) override;
  void restart(const ProblemPtr& problem) override {
    if (problem_) problem_->take_parameters(*problem);
  }
  /// The time of the zero by cubic interpolation.
  std::optional<Stop> after(const MonitoredStep& step) override;
  /// After a failure: the divisor that is at most `almost` times what it was at the start, or (with fixed
  /// steps) would be zero two steps later, and what that means. "" if there is none. `vanished`: only those
  /// that are at most 10⁻³ of it.
  std::string almost_zero(const Point& point, double almost, bool vanished);

 private:
  struct Sample {
    std::vector<double> g, slope;
  };
  Sample evaluate(const Point& point);
  double value_between(const Point& end, double share, std::size_t which);
  std::optional<double> zero(const Point& end, const Sample& there, std::size_t which);
  std::optional<double> zero_of_minimum(const Point& end, double a, double b, std::size_t which);

  ProblemPtr problem_;
  const std::vector<Guard>& guards_;
  codegen::Kernel kernel_;  ///< g, then dg/dt where it is known, else 0
  std::vector<double> out_;
  Point last_, between_;
  Sample here_;
  std::vector<double> first_, before_;  ///< g at the start, and one step before the last point
};

/// After a failure: what the equations need and has almost vanished, as the end of a
/// sentence; "" if nothing has.
std::string near_singularity(SingularityMonitor& divisors, RankMonitor& ranks, const Point& point,
                             double almost);

}  // namespace pendula::integrate
