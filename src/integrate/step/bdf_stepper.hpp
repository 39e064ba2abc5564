// Backward differentiation formulas of variable order 1 … 5 and variable step for F(t, x, x′, z) = 0 of every
// kind: quasi-constant steps, backward differences, the modification of Klopfenstein and Shampine (NDF).
// Shampine & Reichelt, The MATLAB ODE suite, SIAM J. Sci. Comput. 18(1), 1997, §2.
#pragma once

#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/rounding_floor.hpp"
#include "integrate/step/stepper.hpp"

namespace pendula::integrate {

class BdfStepper final : public Stepper {
 public:
  BdfStepper(ProblemPtr problem, int highest_order, std::vector<int> index, Tolerances tolerances,
             StepLimits limits, Stats& stats);

  std::string name() const override { return "bdf"; }
  void start(const Point& point, double end) override;
  void step(double end) override;
  std::size_t record_size() const override { return 3 + static_cast<std::size_t>((order_at_step_ + 1) * N_); }
  void record(double* to) const override;
  void interpolate(const StepView& step, double t, Detail detail, Point& out) override;

 private:
  static constexpr int most = 5;
  double* D(int j) { return differences_.data() + static_cast<std::ptrdiff_t>(j) * N_; }
  void rescale(double factor);
  void predict();
  bool newton(double t, bool& slow);
  RoundingFloor::Answer at_rounding(double length);
  void solve(double* right);
  double scale(int k, double size) const;
  bool factorise();
  bool evaluate_jacobian(double t);
  double scaled_norm(const double* e, double factor) const;
  void update_differences();
  void choose_order(double error);
  void set_end(double t);

  int N_, highest_, order_ = 1, order_at_step_ = 1;
  std::vector<int> index_;
  Derivative derivative_;
  bool determined_ = true;
  std::vector<Position> positions_;
  std::vector<char> in_mass_;
  std::vector<double> entries_, matrix_;
  LinearSolver<double> solver_;
  std::vector<double> differences_, predicted_, psi_, y_, d_, r_, scale_, kept_;
  std::vector<double>
      column_scale_;  ///< c^(1 - index): multipliers of tiny steps are no reason to be singular
  RoundingFloor rounding_;
  double last_length_ = 0;
  double c_ = 0, factorised_for_ = 0, newton_tolerance_ = 0, kept_t_ = 0, kept_dt_ = 0;
  int equal_steps_ = 0, iterations_ = 0;
  bool jacobian_current_ = false, rejected_ = false;
  std::string trouble_;
  Point next_;
};

}  // namespace pendula::integrate
