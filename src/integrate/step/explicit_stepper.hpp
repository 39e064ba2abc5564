// Explicit Runge-Kutta pairs with step size control, for every model whose x′ and z follow from (t, x).
//
// Controller and stiffness test: step_controller.hpp, shared with the lanes of a sweep. The continuous
// extension of a step is the method itself with a smaller step: it needs nothing but the two ends.
#pragma once

#include <optional>

#include "integrate/compiled/explicit_step.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/stage_sums.hpp"
#include "integrate/solve/step_controller.hpp"
#include "integrate/step/stepper.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

class ExplicitStepper final : public Stepper {
 public:
  /// Throws Error naming the method if it is implicit or has no embedded method.
  ExplicitStepper(ProblemPtr problem, TableauPtr tableau, Tolerances tolerances, StepLimits limits,
                  Stats& stats);

  std::string name() const override { return tableau_->name(); }
  void start(const Point& point, double end) override;
  void step(double end) override;
  TableauPtr tableau(const StepView&) const override { return tableau_; }
  bool is_stiff() const override { return Controller::is_stiff(control_); }
  void restart_stiffness_test() override { control_.hits = control_.steps_since_hit = 0; }
  bool is_explicit() const override { return true; }
  double error_by_doubling(const StepView& step) override;

 private:
  Detail look(const StepView& step, double t, Detail detail, Point& out) override;
  using Controller = StepController<double>;
  /// The tableau without its zeros.
  struct Rows {
    std::vector<StageRow> A;
    std::vector<StageRow> prediction;  ///< of x′ and z that are solved for
    StageRow b, error, second_error;
    StageRow stiff;  ///< b minus the row of the second stage at the end of the step
    std::vector<double> c;
  };
  /// Quantities that follow from the tableau alone.
  struct Scheme {
    StepRules rules;
    Rows rows;
  };
  /// The step in hand, stage by stage; not used where it is done by code.
  struct Stages {
    std::vector<double> K, Z;  ///< stage after stage; K goes on with behind_stages()
    std::vector<double> inverse_weight;
  };
  enum class Attempt { accepted, rejected, not_finite };

  static void check(const Tableau& rk);
  static StageRow prediction(const Tableau& rk, int i);
  void predict(int i, int size, double* values) const;
  static Rows rows_of(const Tableau& rk, std::optional<int> stiff_stage);
  /// Remembered: the stability limit takes longer to find than a short run.
  static std::shared_ptr<const Scheme> scheme_of(const TableauPtr& rk);
  double first_step(double end);
  bool compute(const Point& from, double dt);
  Attempt attempt(double dt);
  bool is_last_step_doubtful(double dt) const;
  double size_of(const Vec& x) const;
  double error_norm();
  double unresolved();
  /// 0: x at the end of the step, 1 and 2: its error estimates.
  double* behind_stages(int which) {
    return stages_.K.data() + static_cast<std::ptrdiff_t>(tableau_->stages() + which) * n();
  }
  const double* end_of_step() { return coded_ ? end_.x : behind_stages(0); }
  bool complete();
  void take_slope(Point& out);
  StepSigns<double> signs(double dt);

  TableauPtr tableau_;
  std::shared_ptr<const Scheme> scheme_;
  Controller controller_;
  StepState<double> control_;
  RhsSolver rhs_;
  const Rows& rows_;
  Vec inverse_atol_;
  double stage_accuracy_;  ///< relative, of x′ and z that no mesh point keeps
  std::shared_ptr<CompiledExplicitStep> code_;
  CompiledExplicitStep::End end_{};
  bool coded_ = false;     ///< the last step was: end_ holds it, not stages_
  int code_failures_ = 0;  ///< steps in a row that the code could not make, and the stages could
  Stages stages_;
  std::vector<double> scaled_;  ///< the error, in units of the tolerance
  Vec largest_z_;               ///< so far
  double error_now_ = 0;
  double size_ = 0, size_before_ = 0;  ///< of x in here() and before(), in units of atol
  double last_error_ = 0;  ///< estimate for the step from before() to here(); 0: none, or it is doubtful
  StepSigns<double> signs_;
  Point next_;
};

}  // namespace pendula::integrate
