// Poles of equations as they are written: x′ = -1/x² must not be integrated across x = 0.
//
// A step has passed the zero of a divisor g where g has changed its sign, or where g falls at both ends of
// the step and has grown (or the reverse): stages on both sides of a pole can deceive an error estimate.
//
// That alone is no reason to stop: sin(x)/x is bounded, 1/x may stand in a branch that is not in force. The
// equations on a straight line through the zero of g decide (pole_test.hpp). Integrable poles do not end a
// run, but a step across them, or one that ends or begins almost in them, may err by what it has of their
// area.
//
// Where the equations are bounded and their derivatives are not, as of sin(a/b) where a and b
// vanish together, the run continues, but solutions that were closer than every tolerance may
// diverge from each other behind the zero.
#pragma once

#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "dae/singular/domain_conditions.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

/// A step across a pole is taken back and repeated with shorter ones, until the run ends before it.
class DomainMonitor : public StepMonitor {
 public:
  /// The conditions of a problem's equations but for those that are guards. Cost: of domain_conditions().
  /// wanted = false: none. tolerances: for what is negligible. determined: x′ and z follow from t and x.
  DomainMonitor(const Problem& problem, const std::vector<Guard>& guards, const Tolerances& tolerances,
                bool determined, bool wanted);

  /// The run begins: what almost_outside() compares with.
  void start(const Point& point);
  void restart(const ProblemPtr& problem, const Point& point) override;
  /// Shorter steps: with the reason, if a pole lies in the step; with the error that integrable ones may
  /// cause in it, if that is not admissible.
  std::optional<Rejection> after(const ProblemPtr& problem, const Point& from, const Point& to) override;
  bool is_empty() const override { return poles_.empty(); }
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
  void begin_at(const Point& point);
  enum class Suspicion { none, touched, passed };
  Suspicion suspicion(const Pole& pole, double g, double slope, double dt) const;
  std::optional<Rejection> passed_part(const ProblemPtr& equations, const Point& from, const Point& to);
  std::optional<Rejection> look(const Pole& pole, Suspicion kind, double g, const ProblemPtr& equations,
                                const Point& from, const Point& to);

  ProblemPtr problem_;  ///< a copy: run and monitor place different points
  std::vector<dae::DomainCondition> conditions_;
  std::vector<Pole> poles_;
  codegen::Kernel kernel_;  ///< g of the poles, then their slopes
  Tolerances tolerances_;
  bool determined_;
  std::string not_unique_;
  int pieces_ = 1;  ///< of a step: sines may vanish several times in it
  Point first_, start_, inside_;
  std::vector<double> out_;
};

}  // namespace pendula::integrate
