// The method of an adaptive run: chosen at the start, changed where another one becomes cheaper.
#pragma once

#include <string>

#include "integrate/problem/active_subsystem.hpp"
#include "integrate/run/adaptive_state.hpp"
#include "integrate/run/methods.hpp"

namespace pendula::integrate {

class MethodSelector {
 public:
  /// Requires that the state outlives it.
  MethodSelector(AdaptiveState& state, const Method& method);

  /// The method that was asked for or, for "auto", the one that suits the model and the tolerances.
  void start(const Point& point);
  /// The method in use, for the state's problem, which has changed. It has to begin at a point then.
  void renew();
  /// One step; where "auto" has chosen an explicit method that cannot go on, an implicit one may.
  void step();
  /// Explicit → implicit where stiffness begins, and back where it ends, when it pays: many more steps of this size
  /// would follow.
  void change_if_it_pays();

 private:
  bool is_automatic() const { return !method_.family; }
  void use(const MethodFamily& family, const Point& point, const std::string& why);
  void change(const MethodFamily& family, double dt, const std::string& why);
  void leave_explicit();
  void leave_implicit();
  void judge_change();
  /// Passes over the nonzeros of the equations so far, a factorisation counting as several.
  double work();

  AdaptiveState& state_;
  Method method_;
  std::shared_ptr<const DependencyGraph> couplings_;  ///< of a large model
  const MethodFamily* family_ = nullptr;              ///< in use
  std::string name_;                                  ///< of all methods so far
  /// Looks at the stiffness of an implicit method's steps: the next one, steps between two, favourable in a row.
  struct {
    long next = 25, apart = 25, favourable = 0;
  } look_;
  /// Where the work of steps was counted.
  Rival rival_;
  /// What an implicit method has cost, until the explicit one that follows has been compared with it.
  struct {
    double t = 0, work = 0;             ///< where counting began
    double per_time = 0, dt = 0;        ///< the implicit method's work, and its last step
    long begin_at = 0, compare_at = 0;  ///< steps: first ones are small; 0: nothing to compare
  } past_;
};

}  // namespace pendula::integrate
