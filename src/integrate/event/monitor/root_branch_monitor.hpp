// Form "minimal" takes one root y = -√D of a constraint. Where D touches 0 the solution may continue as +√D,
// while the form continues with the mirror image -√D.
#pragma once

#include <deque>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/event/monitor/monitor.hpp"

namespace pendula::integrate {

/// Such a touch shows as a kink of √D: it falls and rises again with opposite slopes, so that -√D before it
/// continues smoothly as +√D behind it. Between two points on both sides, the trapezoidal rule decides:
/// √D₂ - √D₁ (no touch) against -√D₂ - √D₁ (a touch).
class RootBranchMonitor : public Monitor {
 public:
  /// Monitors the guards with `root`.
  RootBranchMonitor(const ProblemPtr& problem, const std::vector<Guard>& guards);
  bool empty() const { return roots_.empty(); }
  void start(const Point& point) override;
  void restart(const ProblemPtr& problem) override {
    if (problem_) problem_->take_parameters(*problem);
  }
  std::optional<Stop> after(const MonitoredStep& step) override { return inspect(step.here); }

 private:
  struct Sample {
    double t, s, slope;  ///< s = √D
  };
  std::optional<Stop> inspect(const Point& point);
  static std::optional<double> kink(const std::deque<Sample>& list);

  ProblemPtr problem_;
  std::vector<Guard> roots_;
  codegen::Kernel kernel_;  ///< √D, then its derivative
  std::vector<double> out_;
  std::vector<std::deque<Sample>> samples_;
  std::vector<double> largest_;
};

}  // namespace pendula::integrate
