// Rosenbrock methods with step size control: linearly implicit, no iterations. For M x′ = f(t, x, z) with a
// constant M, singular or not: ODE and semi-explicit models of index 1 (docs/derivations.md#rosenbrock).
//
// In terms of F(t, x, x′, z) = M x′ - f the stages of rosenbrock.hpp read
//
//     (M/(γh) + ∂F/∂y) uᵢ = -F(tᵢ, y + Σ aᵢⱼuⱼ, x′ = -Σ cᵢⱼuⱼ/h) - γᵢ h ∂F/∂t
#pragma once

#include "integrate/compiled/rosenbrock_step.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/predictive_controller.hpp"
#include "integrate/step/increment_check.hpp"
#include "integrate/step/pulse_watch.hpp"
#include "integrate/step/stepper.hpp"
#include "method/rosenbrock.hpp"

namespace pendula::integrate {

class RosenbrockStepper final : public Stepper {
 public:
  /// Throws Error when ∂F/∂x′ is not constant, or the method has no error estimate.
  RosenbrockStepper(ProblemPtr problem, RosenbrockPtr method, Tolerances tolerances, StepLimits limits,
                    Stats& stats);

  std::string name() const override { return method_->name(); }
  void start(const Point& point, double end) override;
  void step(double end) override;
  std::size_t record_size() const override { return 2 + last_.dense.size(); }
  void record(double* to) const override;

 private:
  Detail look(const StepView& step, double t, Detail detail, Point& out) override;
  void require_constant_mass() const;
  void prepare_code();
  bool use_code();
  void begin_step();
  bool time_derivative(const Point& at);
  double attempt(double dt);
  double attempt_apart(double dt);
  bool jacobian_is_finite();
  bool linearise();
  bool factorise(double dt);
  bool stages(double dt);
  double error_norm();
  double error_at_end(double dt);
  void keep_jacobian(const Point& at, std::vector<double>& entries);
  bool jacobian_has_changed(double gh);
  void set_weights();
  bool factorise_at_end(double gh, const std::vector<double>& entries);
  void curve(const double* dense, double part, double dt, double* y, double* slope) const;
  double missed_on_the_way(double dt);
  bool filter_missed(double dt, const Vec& missed, std::vector<double>& e);
  void end_step(double dt);
  bool complete(double dt);
  bool refine(const StepView& step, double t, Point& out);

  RosenbrockPtr method_;
  int N_;
  /// Its rows, for sums over stages; C with the other sign.
  struct Sums {
    std::vector<std::vector<double>> A, C, dense;
    std::vector<double> m, e;
  };
  Sums sums_;
  RhsSolver rhs_;
  /// Of ∂F/∂(x, x′, z), as a matrix of size n + m: what belongs to x′ is added to what belongs to x.
  struct Pattern {
    std::vector<Position> positions;
    std::vector<char> in_mass, in_mass_row;  ///< by entry, by row
  };
  Pattern rows_;
  std::vector<double> entries_, matrix_;
  double entries_at_ = std::numeric_limits<double>::quiet_NaN();  ///< t of the Jacobian that is known last
  LinearSolver<double> solver_;
  IncrementCheck check_;
  PulseWatch pulses_;
  codegen::Kernel time_kernel_;
  bool depends_on_time_ = false;
  std::vector<double> y_, U_, Ft_, R_, scaled_;
  /// Of error_at_end().
  struct AtEnd {
    std::vector<double> entries;          ///< of the Jacobian
    std::vector<double> undamped;         ///< what the estimated error solves: Σ eᵢ times the right sides
    std::vector<double> weights, bounds;  ///< of the unknowns, of the rows
    LinearSolver<double> solver;
  };
  AtEnd at_end_;
  struct LastStep {
    double t = 0, dt = 0;
    std::vector<double> dense;  ///< y₀, y₁, K₁ …
  };
  LastStep last_;
  Point next_;
  PredictiveController control_;
  std::shared_ptr<CompiledRosenbrockStep> code_;  ///< whole steps, where there is code
  CompiledRosenbrockStep::End end_{};             ///< of the last one
};

}  // namespace pendula::integrate
