// Backward differentiation formulas of variable order 1 … 5 and variable step for F(t, x, x′, z) = 0 of every
// kind: quasi-constant steps, backward differences, the modification of Klopfenstein and Shampine (NDF).
// Shampine & Reichelt, The MATLAB ODE suite, SIAM J. Sci. Comput. 18(1), 1997, §2;
// docs/derivations.md#bdf.
#pragma once

#include <optional>

#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/rounding_floor.hpp"
#include "integrate/step/increment_check.hpp"
#include "integrate/step/stepper.hpp"

namespace pendula::integrate {

class BdfStepper final : public Stepper {
 public:
  BdfStepper(ProblemPtr problem, int highest_order, std::vector<int> index, Tolerances tolerances,
             StepLimits limits, Stats& stats);

  std::string name() const override { return "bdf"; }
  void start(const Point& point, double end) override;
  void step(double end) override;
  std::size_t record_size() const override { return 3 + static_cast<std::size_t>((last_.order + 1) * N_); }
  void record(double* to) const override;
  bool is_determined() const override { return determined_; }

 private:
  Detail look(const StepView& step, double t, Detail detail, Point& out) override;
  static constexpr int most =
      5;  ///< order, as in Shampine & Reichelt (1997): BDF of order 6 is A(18°)-stable only
  enum class Newton { converged, slow, not_finite };
  struct Pattern {
    std::vector<Position> positions;
    std::vector<char> in_mass;
    /// c^(1 - index) of every column: multipliers of tiny steps are no reason to be singular.
    std::vector<double> column_scale;
    bool returning = false;  ///< see largest_return
  };
  struct Jacobian {
    std::vector<double> entries, matrix;  ///< the latter with the factor for x′
    double factorised_for = 0;            ///< c
    bool fresh = false;                   ///< of this attempt
  };
  /// ∇⁰y … ∇^(order + 2) y at the last point for steps of the size dt_.
  struct History {
    std::vector<double> differences;
    int order = 1, equal_steps = 0;
  };
  /// The step in hand: x′ = (ψ + d)/c, y = predicted + d.
  struct Attempt {
    double c = 0;
    std::vector<double> predicted, psi, y, d, r, scale;
    std::vector<double> residual;  ///< F in the last iteration
  };
  struct Iteration {
    double tolerance = 0, length = 0;  ///< length: of the last correction
    int count = 0;
  };
  struct LastStep {
    int order = 1;
    double t = 0, dt = 0;
    std::vector<double> differences;
  };

  double* D(int j) { return history_.differences.data() + static_cast<std::ptrdiff_t>(j) * N_; }
  void rescale(double factor);
  bool predict_algebraic(double end);
  void predict();
  Newton newton(double t);
  bool plausible();
  void residual_at_end();
  bool is_hidden();
  bool is_corrected();
  Newton solve_step(double t);
  RoundingFloor::Answer at_rounding(double length);
  void solve(double* right);
  double scale(int k, double size) const;
  bool factorise();
  bool evaluate_jacobian(double t);
  double scaled_norm(const double* e, double factor) const;
  double safety_factor() const;
  void reject(double factor);
  void accept(double t, double error);
  void update_differences();
  void choose_order(double error);
  void set_end(double t);

  static constexpr int most_corrections = 4;  ///< as in ode15s and SciPy's BDF
  int N_, highest_;
  std::vector<int> index_;
  RhsSolver rhs_;
  bool z_slopes_known_ = true;  ///< a step has been made since the start
  bool determined_ = true;      ///< x′ and z follow from (t, x)
  Pattern rows_;
  Jacobian jacobian_;
  LinearSolver<double> solver_;
  History history_;
  Attempt attempt_;
  Iteration iteration_;
  IncrementCheck check_;
  RoundingFloor rounding_;
  LastStep last_;
  std::optional<double> restarted_at_;  ///< the point of the last restart after failures
  bool rejected_ = false;
  int failures_ = 0;  ///< in a row
  Point next_;
};

}  // namespace pendula::integrate
