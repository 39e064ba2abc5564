// Radau IIA of variable order 5, 9, 13, and other collocation methods, with step size control, for
// F(t, x, x′, z) = 0 of every kind: explicit ODE, mass matrix, semi-explicit, fully implicit; index 1, and
// index 2 and 3 with the error test scaled by h per index.
//
// Simplified Newton iterations in transformed variables, one real and (s - 1)/2 complex systems of size n +
// m; predictive step size control; Jacobian and factorisations are kept while they serve. Hairer & Wanner,
// Solving ODEs II, 2nd ed., §IV.8; order selection: Hairer & Wanner, Stiff differential equations solved by
// Radau methods, J. Comput. Appl. Math. 111, 1999.
#pragma once

#include "integrate/compiled/newton_step.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/rounding_floor.hpp"
#include "integrate/step/runge_kutta.hpp"
#include "integrate/step/stepper.hpp"
#include "method/irk_formula.hpp"

namespace pendula::integrate {

/// to += factor · from
inline void add_multiple(double* to, double factor, const double* from, int count) {
  for (int k = 0; k < count; ++k) to[k] += factor * from[k];
}

class IrkStepper final : public Stepper {
 public:
  /// formulas: of ascending order; the method changes between them. index: of every unknown (x, z), 1 … 3;
  /// empty: all 1.
  IrkStepper(std::string name, ProblemPtr problem, std::vector<std::shared_ptr<const IrkFormula>> formulas,
             std::vector<int> index, Tolerances tolerances, StepLimits limits, Stats& stats);

  std::string name() const override { return name_; }
  void start(const Point& point, double end) override;
  void step(double end) override;
  std::size_t record_size() const override;
  void record(double* to) const override;
  TableauPtr tableau(const StepView& step) const override { return formulas_[step.record[0]]->tableau; }
  void interpolate(const StepView& step, double t, Detail detail, Point& out) override;

 private:
  /// Contraction below which the Jacobian serves another step.
  static constexpr double keep_jacobian_below = 0.001;
  enum class Newton { converged, slow, diverged, not_finite };
  struct Matrices {
    LinearSolver<double> real;
    std::vector<LinearSolver<std::complex<double>>> complex;
    std::shared_ptr<NewtonCode> code;  ///< holds the factors at hand, if there is code
  };
  const IrkFormula& f() const { return *formulas_[level_]; }
  Matrices& matrices() { return matrices_[level_]; }
  void use(int level);
  int first_level() const;
  void prepare_tolerances();
  void set_scales(double dt);
  bool evaluate_jacobian();
  bool factorise(double dt);
  void shift(double factor);
  void shift(std::complex<double> factor);
  bool factorise_pairs(double dt);
  bool use_code(double dt, bool now);
  void prepare_code();
  void start_iteration(double dt);
  void predict(double dt);
  Newton newton(double dt);
  double iterate(double dt);
  double iterate(NewtonCode& code);
  bool residuals(double dt);
  void solve_stages();
  double error_norm(double dt, bool again);
  double error_norm(NewtonCode& code, bool again);
  void end_step(double dt);
  double filtered_error(const double* y, double dt);
  bool complete(double dt);
  void choose_next(double dt, double error);
  void choose_order(double quotient);
  void reject(double dt, double error);
  void refine(const StepView& step, std::size_t level, double t, Point& out);
  RoundingFloor::Answer at_rounding(double dt, double length);
  std::string blame() const;

  std::string name_;
  std::vector<std::shared_ptr<const IrkFormula>> formulas_;
  std::vector<int> index_;
  int level_ = 0, N_;
  Derivative derivative_;
  bool determined_ = true;  ///< x′ and z follow from (t, x)

  std::vector<Position> positions_;
  std::vector<char> in_mass_;  ///< the entry belongs to ∂F/∂x′
  std::vector<char> bare_;     ///< rows of index 2 and 3: constraints in x alone
  std::vector<double> entries_, real_entries_;
  std::vector<std::complex<double>> complex_entries_, complex_right_;
  std::vector<Matrices> matrices_;  ///< one set per formula
  double factorised_for_ = 0;
  long iterations_counted_ = 0;  ///< by NewtonCode::make

  std::vector<double> y_, Z_, old_Z_, R_, transformed_, scale_, inverse_scale_, error_, velocity_, lagrange_;
  std::vector<double> weights_;  ///< of a sum over the stages
  Vec rtol_, atol_;              ///< of the error estimate, which is of lower order than the method
  double newton_tolerance_ = 0, last_length_ = 0;
  RoundingFloor rounding_;
  Point next_;
  int old_level_ = 0, next_level_ = 0;
  double old_dt_ = 0, step_dt_ = 0, step_t_ = 0;
  std::vector<double> step_y_;

  NewtonCode::End end_{};  ///< of the step in hand, where there is code
  double theta_ = 0, contraction_ = 1, slow_factor_ = 0.5;
  int iterations_ = 0, since_order_change_ = 0, newton_failures_ = 0;
  double accepted_dt_ = 0, accepted_error_ = 0;
  bool first_ = true, rejected_ = false, jacobian_fresh_ = false, keep_ = false;
  std::string trouble_;
  std::vector<std::shared_ptr<RungeKutta>> dense_;
};

}  // namespace pendula::integrate
