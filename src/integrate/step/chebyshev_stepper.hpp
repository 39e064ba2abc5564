// Runge-Kutta-Chebyshev methods with step size control: explicit, for equations whose stiffness is
// diffusion. The step size follows from the error alone, the number of stages from the spectral radius,
// which is measured along the way.
//
// Error estimate 0.8 (x₀ - x₁) + 0.4 h (f₀ + f₁) and power iteration for the spectral radius: Sommeijer,
// Shampine & Verwer, J. Comput. Appl. Math. 88, 1998, §2.2 and §3.2.
#pragma once

#include <map>

#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/predictive_controller.hpp"
#include "integrate/step/stepper.hpp"
#include "method/chebyshev.hpp"

namespace pendula::integrate {

class ChebyshevStepper final : public Stepper {
 public:
  ChebyshevStepper(ProblemPtr problem, Tolerances tolerances, StepLimits limits, Stats& stats);

  std::string name() const override { return "rkc"; }
  void start(const Point& point, double end) override;
  void step(double end) override;
  bool is_explicit() const override { return true; }

 private:
  Detail look(const StepView& step, double t, Detail detail, Point& out) override;
  enum class Attempt { accepted, rejected, not_finite };
  const Chebyshev& method(int stages);
  void measure_spectrum();
  Attempt attempt(double dt);
  bool compute(const Point& from, double dt, Point& out);

  RhsSolver rhs_;
  std::map<int, Chebyshev> methods_;
  PredictiveController control_;
  Point next_;
  Vec Y_[3], F_, direction_, error_;
  double radius_ = 0, norm_ = 0;
  int since_spectrum_ = 0;
};

}  // namespace pendula::integrate
