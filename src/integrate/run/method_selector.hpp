// The method of an adaptive run: chosen at the start, changed where another one becomes cheaper.
#pragma once

#include <optional>
#include <string>

#include "integrate/problem/active_subsystem.hpp"
#include "integrate/run/adaptive_state.hpp"
#include "integrate/run/explicit_forecast.hpp"
#include "integrate/run/methods.hpp"
#include "integrate/run/steady_steps.hpp"

namespace pendula::integrate {

class MethodSelector {
 public:
  /// Requires that the state outlives it.
  MethodSelector(AdaptiveState& state, const Method& method);

  /// The method that was asked for or, for "auto", the one that suits the model and the tolerances.
  void start(const Point& point);
  /// The method in use, for the state's problem, which has changed. It has to begin at a point then.
  void renew();
  /// Begins by an implicit method where the explicit one that "auto" has chosen cannot, since an equation
  /// there determines x itself; for the rest of the run. False for other methods.
  bool start_implicitly(const Point& point);
  /// One step; where the method that "auto" has chosen cannot go on, one of the other kind may.
  void step();
  /// Explicit → implicit where stiffness begins, and back where explicit steps would be less work, when it
  /// pays: many more steps of this size would follow. docs/derivations.md#choice-of-the-method
  void change_method_if_cheaper();

 private:
  bool is_automatic() const { return !method_.family; }
  void use(const MethodFamily& family, const Point& point, const std::string& why);
  void change(const MethodFamily& family, double dt, const std::string& why);
  void begin_counting();
  void leave_explicit();
  void leave_implicit();
  void judge_change();
  void try_implicit();
  bool try_where_steps_cost_more();
  bool is_known_to_cost_less(double dt);
  bool higher_order_is_cheaper() const;
  bool may_become_explicit() const;
  void become_explicit(double dt);
  /// The method for equations that are stiff from here on.
  const MethodFamily& implicit() const;
  double left() const;
  /// Work of the method in use so far, in explicit steps: passes over the nonzeros of the equations, where a
  /// factorisation counts as several; for large models the work that StepWork has counted.
  double work();
  double work_of(const Stats& stats);

  AdaptiveState& state_;
  Method method_;
  std::shared_ptr<const DependencyGraph> couplings_;  ///< of a large model
  const MethodFamily* family_ = nullptr;              ///< in use
  std::string name_;                                  ///< of all methods so far
  StepCosts costs_;                                   ///< where the work of steps was counted
  std::optional<ExplicitWork> explicit_;              ///< known where an implicit method has been used
  ExplicitForecast forecast_;
  SteadySteps steady_;           ///< of the method in use
  int failures_recovered_ = 0;   ///< steps of an implicit method that failed, and an explicit one went on
  bool is_lasting_ = false;      ///< steps of a Rosenbrock method turned out to be many
  bool needs_implicit_ = false;  ///< see start_implicitly()
  /// The explicit method in use, and what the implicit one before has cost.
  struct {
    long begin = 0;                         ///< steps
    double t = 0, work = 0;                 ///< where counting began: first steps are small
    double per_time = 0, span = 0, dt = 0;  ///< the implicit method's work, over which stretch, its last step
    long stayed = 0;                        ///< when stiffness was seen last and was not worth a change
    bool is_judged = true;
  } past_;
  /// Looks at whether an implicit method is worth a trial: steps since the explicit one began.
  struct {
    long first = 40, next = 0, costly = 25;
    int favourable = 0;  ///< in a row
    Stats begun;         ///< when the explicit method began, at t
    double t = 0;
  } trial_;
};

}  // namespace pendula::integrate
