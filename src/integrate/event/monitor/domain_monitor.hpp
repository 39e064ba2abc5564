// Poles of equations as they are written: x′ = -1/x² must not be integrated across x = 0.
//
// A step has passed the zero of a divisor g where g has changed its sign, or where g falls at both ends of
// the step and has grown (or the reverse): stages on both sides of a pole can deceive an error estimate.
//
// That alone is no reason to stop: sin(x)/x is bounded, 1/x may stand in a branch that is not in force. The
// residual F decides: on a straight line through the zero of g, at distances that shrink by 10⁻³ each time, a
// pole of order k grows by 10³ᵏ; a bounded residual, or one that grows like a logarithm, does not. A bounded
// residual without limit, such as cos(1/x), ends the run, too: its changes neither fade nor keep their sign.
//
// Where the equations are bounded and their derivatives are not, as of sin(a/b) where a and b
// vanish together, the run continues, but solutions that were closer than every tolerance may
// diverge from each other behind the zero.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "dae/singular/domain_conditions.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

/// No Monitor (monitor.hpp), which ends a run: a step across a pole is taken back and repeated with shorter
/// ones, until the run ends before it.
class DomainMonitor {
 public:
  /// The conditions of a problem's equations but for those that are guards. Cost: of domain_conditions().
  /// wanted = false: none. tolerances: for what oscillates without end with negligible effect.
  DomainMonitor(const Problem& problem, const std::vector<Guard>& guards, const Tolerances& tolerances,
                bool wanted);

  void start(const Point& point);
  /// The solution has jumped to this point.
  void restart(const Point& point);
  /// After every accepted step: why it must not be taken, if a pole lies in it. `equations`: those in force.
  std::optional<std::string> passed(Problem& equations, const Point& from, const Point& to);
  /// Where a zero that is no pole was passed and more than one solution goes on, as
  /// in x′ = 2 x/t; "" if nowhere.
  const std::string& not_unique() const { return not_unique_; }
  /// After a failure at a point: ". x is almost 0 there; where it is 0, log(x) is not defined", of the
  /// condition that is closest to 0; "" if none is.
  std::string almost_outside(const Point& point);

 private:
  struct Pole {
    Expr factor;
    std::size_t condition;
    double g = 0, slope = 0;  ///< at the last point; slope: dg/dt, 0 if it is not known
  };
  void evaluate(codegen::Kernel& kernel, const Point& point);
  bool suspicious(const Pole& pole, double g, double slope, double dt) const;
  std::optional<std::string> passed_part(Problem& equations, const Point& from, const Point& to);

  ProblemPtr problem_;  ///< a copy: run and monitor place different points
  std::vector<dae::DomainCondition> conditions_;
  std::vector<Pole> poles_;
  codegen::Kernel kernel_;  ///< g of the poles, then their slopes
  Tolerances tolerances_;
  std::string not_unique_;
  int pieces_ = 1;  ///< of a step: sines may vanish several times in it
  Point first_, start_, inside_;
  std::vector<double> out_;
};

}  // namespace pendula::integrate
