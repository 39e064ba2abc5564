// A form's choice of states that degenerates without a change of sign.
//
// Form "array" of a pendulum may take y and v_y as states. On the way down x → 0, where they no longer
// determine x: a run does not pass that point but comes to rest at it, at a distance that its
// tolerances hide, and loses the energy.
#pragma once

#include <memory>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class ChoiceMonitor : public Monitor {
 public:
  /// Requires that the guards, those of the plan's `choices`, and the tolerances outlive it.
  ChoiceMonitor(const ProblemPtr& problem, const std::vector<Guard>& choices, const Tolerances& tolerances);
  bool empty() const { return guards_.empty(); }
  void start(const Point& point) override;
  void restart(const ProblemPtr& problem) override {
    if (problem_) problem_->take_parameters(*problem);
  }
  /// The guard that errors of the states within the tolerances can make 0, after several steps in a row.
  std::optional<Stop> after(const MonitoredStep& step) override;

 private:
  struct Seen {
    double largest = 0;
    int close = 0;  ///< steps in a row at whose end the guard was uncertain
  };
  void evaluate(const Point& point, std::vector<double>& g);
  std::vector<double> uncertainties(const Point& point, const std::vector<double>& g);

  ProblemPtr problem_;
  const std::vector<Guard>& guards_;
  const Tolerances& tolerances_;
  codegen::Kernel kernel_;
  std::vector<double> g_, moved_;
  std::vector<Seen> seen_;
  Stats ignored_;
  std::unique_ptr<RhsSolver> solver_;
};

}  // namespace pendula::integrate
