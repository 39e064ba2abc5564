// Explicit Runge-Kutta pairs with step size control, for every model whose x′ and z follow from (t, x).
//
// The controller is Gustafsson's PI controller as DOPRI5 uses it (Hairer, Nørsett & Wanner, Solving ODEs I,
// 2nd ed., §II.4; II, §IV.2 for the stiffness test). The continuous extension of a step is the interpolant of
// the method if it has one, else the method itself with a smaller step: both need nothing but the two ends.
#pragma once

#include "integrate/compiled/explicit_step.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/step/stepper.hpp"
#include "method/step_control.hpp"
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
  void interpolate(const StepView& step, double t, Detail detail, Point& out) override;
  bool is_stiff() const override { return stiff_hits_ >= stiff_enough; }

 private:
  static constexpr int stiff_enough = 25;
  struct Term {
    int stage;
    double factor;
  };
  using Row = std::vector<Term>;
  enum class Attempt { accepted, rejected, not_finite };

  static const Tableau& checked(const Tableau& rk);
  void prepare();
  double first_step(double end);
  bool stages(const Point& from, double dt);
  Attempt attempt(double dt);
  double error_norm();
  double combined_norm(double first, double third) const;
  /// 0: x at the end of the step, 1 and 2: its error estimates.
  double* behind_stages(int which) { return K_.data() + static_cast<std::ptrdiff_t>(stages_ + which) * n(); }
  const double* end_of_step() { return coded_ ? end_.x : behind_stages(0); }
  bool complete();
  bool is_smooth() const;
  void watch_stiffness(double dt);
  void remember_rejection(double dt);
  bool fsal() const { return rules_.fsal; }
  void sketch(const StepView& step, double t, Point& out) const;
  void adapt(double dt, Attempt outcome);

  TableauPtr tableau_;
  ExplicitRules rules_;
  Derivative derivative_;
  std::vector<Row> rows_;  ///< of A
  Row weights_, error_, second_error_, stiff_row_;
  std::vector<double> c_;
  int stages_;
  std::shared_ptr<ExplicitCode> code_;
  ExplicitCode::End end_{};
  bool coded_ = false;         ///< the last step was: end_ holds it, not K_
  std::vector<double> K_, Z_;  ///< stage after stage; K_ goes on with behind_stages()
  std::vector<double> scaled_, inverse_weight_;
  Vec x_, trial_;
  Point next_;
  double error_now_ = 0;
  float log_error_old_ = 0;
  bool rejected_ = false;
  std::string trouble_;
  int stiff_hits_ = 0, calm_ = 0;
  // Rejections again and again at one step size: the edge of stability.
  double rejected_dt_ = 0, longest_since_ = 0;
  int accepted_since_ = 0, alike_ = 0;
  long since_start_ = 0;
  double ceiling_ = std::numeric_limits<double>::infinity();  ///< of dt where stability limits it
};

}  // namespace pendula::integrate
