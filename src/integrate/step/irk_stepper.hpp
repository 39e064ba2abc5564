// Radau IIA of variable order 5, 9, 13, and other collocation methods, with step size control, for
// F(t, x, x′, z) = 0 of every kind: explicit ODE, mass matrix, semi-explicit, fully implicit; index 1, and
// index 2 and 3 with the error test scaled by h per index.
//
// Simplified Newton iterations in transformed variables, one real and (s - 1)/2 complex systems of size n +
// m; predictive step size control; Jacobian and factorisations are kept while they serve. Hairer & Wanner,
// Solving ODEs II, 2nd ed., §IV.8; order selection: Hairer & Wanner, Stiff differential equations solved by
// Radau methods, J. Comput. Appl. Math. 111, 1999; docs/derivations.md#radau.
#pragma once

#include <utility>

#include "integrate/compiled/newton_step.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/predictive_controller.hpp"
#include "integrate/solve/rounding_floor.hpp"
#include "integrate/step/increment_check.hpp"
#include "integrate/step/pulse_watch.hpp"
#include "integrate/step/stepper.hpp"
#include "method/irk_formula.hpp"

namespace pendula::integrate {

/// to += factor · from
inline void add_multiple(double* to, double factor, const double* from, int count) {
  for (int k = 0; k < count; ++k) to[k] += factor * from[k];
}

class IrkStepper final : public Stepper {
 public:
  /// formulas: of ascending order; the method changes between them. index: of every
  /// unknown (x, z), 1 … 3; empty: all 1.
  IrkStepper(std::string name, ProblemPtr problem, std::vector<std::shared_ptr<const IrkFormula>> formulas,
             std::vector<int> index, Tolerances tolerances, StepLimits limits, Stats& stats);

  std::string name() const override { return name_; }
  void start(const Point& point, double end) override;
  void step(double end) override;
  std::size_t record_size() const override;
  void record(double* to) const override;
  TableauPtr tableau(const StepView& step) const override { return formulas_[step.record[0]]->tableau; }
  bool is_determined() const override { return determined_; }
  double error_by_doubling(const StepView& step) override;

 private:
  Detail look(const StepView& step, double t, Detail detail, Point& out) override;
  /// Contraction below which the Jacobian serves another step: as in RADAU5 (Hairer & Wanner II, §IV.8).
  static constexpr double keep_jacobian_below = 0.001;
  static constexpr int affordable = 150;  ///< stages times unknowns: steps inside of steps
  enum class Newton { converged, slow, diverged, not_finite };
  /// Why a step is repeated.
  enum class Rejection {
    error,      ///< its error was too large
    slow,       ///< Newton's iteration would take too long: a little shorter
    unsolvable  ///< no solution, or not a finite one: half
  };
  struct Matrices {
    LinearSolver<double> real;
    std::vector<LinearSolver<std::complex<double>>> complex;
    std::shared_ptr<CompiledNewtonStep> code;  ///< holds the factors at hand, if there is code
  };
  /// Of ∂F/∂(x, x′, z), as a matrix of size n + m: what belongs to x′ is added to what belongs to x.
  struct Pattern {
    std::vector<Position> positions;
    std::vector<char> in_mass;  ///< the entry belongs to ∂F/∂x′
    std::vector<char> bare;     ///< rows of index 2 and 3: constraints in x alone
    bool returning = false;     ///< see largest_return
  };
  struct Jacobian {
    std::vector<double> entries;
    std::vector<double> before;  ///< the one before, finite; serves where √|x| has no derivative
    bool fresh = false;          ///< of this step
    bool keep = false;           ///< serves the next step
    double factorised_for = 0;   ///< dt; 0: not
    LinearSolver<double> end;    ///< of factorise_apart()
  };
  /// The entries with a factor for those of x′, and a right side.
  struct Shifted {
    std::vector<double> real;
    std::vector<std::complex<double>> complex, right;
  };
  /// Starting values by the whole polynomial of the last step.
  struct Prediction {
    double tolerable_error = 0;  ///< length of a first correction; 0: others are in use
    double first = 0;            ///< its length
    int suspect_steps = 0;       ///< steps that still begin with polynomials of lower degree
    void failed() {
      if (tolerable_error > 0 && first > tolerable_error) suspect_steps = 10;
    }
  };
  struct Iteration {
    double tolerance = 0;
    int count = 0;
    double length = 0;         ///< of the last correction
    double theta = 0;          ///< contraction
    double contraction = 1;    ///< Θ/(1 - Θ), an estimate where only one iteration was made
    double slow_factor = 0.5;  ///< of dt, when it was slow
    int failures = 0;          ///< since the last accepted step
    int checks_due = 0;        ///< steps that are still checked: correction_at_end()
    long counted = 0;          ///< of Stats::newton_iterations, by CompiledNewtonStep::make
    Prediction prediction{};
  };
  /// Which of the formulas makes this step and the next, and the steps since the last change.
  struct OrderChoice {
    int level = 0, next = 0, since_change = 0;
  };
  /// The tolerances of the error estimate, which is of lower order than the method, and the scales from them.
  struct Scales {
    Vec rtol, atol;
    std::vector<double> scale, inverse;
  };
  /// The last accepted step, for its continuation.
  struct LastStep {
    int level = 0;
    double t = 0, dt = 0;     ///< dt = 0: there is none
    double distance = 0;      ///< from its beginning to its last stage, in tolerances
    bool repeated = false;    ///< it was accepted after rejections
    bool distrusted = false;  ///< continued, it has led nowhere
    std::vector<double> y, Z;
    std::shared_ptr<IrkStepper> inside;  ///< makes steps to times inside of it
    Stats inside_stats;
  };
  struct Work {
    std::vector<double> R, transformed, velocity, lagrange;
    std::vector<double> residual;  ///< F at the last stage, in the last iteration
    std::vector<double> weights;   ///< of a sum over the stages
  };

  const IrkFormula& f() const { return *formulas_[order_.level]; }
  Matrices& matrices() { return matrices_[order_.level]; }
  int most_iterations() const { return 7 + (f().s - 3) * 5 / 2; }
  void use(int level);
  int first_level() const;
  void prepare_tolerances();
  void set_scales(double dt);
  void begin_at_here();
  Point expected_end(double dt);
  /// At the start of the step; ahead > 0: where one of this size is expected to end.
  bool evaluate_jacobian(double ahead = 0);
  bool factorise(double dt);
  void shift(double factor);
  void shift(std::complex<double> factor);
  bool factorise_pairs(double dt);
  bool use_code(double dt, bool now);
  void prepare_code();
  int degree_continued(double dt);
  void start_iteration(double dt);
  void predict(double dt, int degree);
  Newton newton(double dt);
  double iterate(double dt);
  double iterate(CompiledNewtonStep& code);
  bool plausible(double dt);
  std::pair<const double*, std::ptrdiff_t> last_residual();
  bool residuals(double dt);
  void solve_stages();
  double error_norm(double dt, bool again);
  double correction_at_end(double dt);
  bool factorise_apart(const std::vector<double>& entries, double gh);
  void polynomial(double part, double dt, double* value, double* slope) const;
  double missed_between_stages(double dt);
  double unresolved(double dt);
  bool corrected_there(double t, double dt, const double* y, Vec& xdot, Vec& z);
  bool filter_missed(double dt, const Vec& missed, std::vector<double>& e);
  double stiff_error_at_end(double dt);
  void release_stiff_error(double dt);
  double damped_error_norm(double dt, bool again);
  double damped_error_norm(CompiledNewtonStep& code, bool again);
  void end_step(double dt);
  double filtered_error(const double* y);
  bool complete(double dt);
  void accept(double dt, double error, double end);
  double safety_factor() const;
  double distance_to_last_stage() const;
  void choose_order(double quotient);
  void reject(double dt, Rejection why, double error = 0);
  IrkStepper& inside();
  void refine(const StepView& step, int level, double t, Point& out);
  bool reaches(const StepView& step, int level, double t);
  bool goes(StepView& part, double t);
  double departure(const StepView& step, const Point& curve, const Point& inside) const;
  RoundingFloor::Answer at_rounding(double dt, double length);
  std::string blame() const;

  std::string name_;
  std::vector<std::shared_ptr<const IrkFormula>> formulas_;
  std::vector<int> index_;
  OrderChoice order_;
  int N_;
  RhsSolver rhs_;
  bool determined_ = true;  ///< x′ and z follow from (t, x)
  bool driven_;             ///< F contains t
  Pattern rows_;
  Jacobian jacobian_;
  Shifted shifted_;
  std::vector<Matrices> matrices_;  ///< one set per formula
  Scales scales_;
  PredictiveController control_;
  Iteration iteration_;
  IncrementCheck check_;
  PulseWatch pulses_;
  RoundingFloor rounding_;
  std::vector<double> y_, Z_, error_;
  CompiledNewtonStep::End end_{};  ///< of the step in hand, where there is code
  Work work_;
  Point next_;
  LastStep last_;
};

}  // namespace pendula::integrate
