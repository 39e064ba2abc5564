// Explicit steps with step size control for several parameter sets at once, as straight-line machine code.
//
// Every lane has its own t, dt, error estimate and decision: a step that is not accepted leaves the lane's
// state as it was, with a smaller dt. Nothing a lane computes depends on the others. Step
// (pair_emitter.hpp) and controller (step_controller.hpp) are those of ExplicitStepper: where f gives the
// same bits, lanes take the same steps.
#pragma once

#include <memory>
#include <vector>

#include "codegen/machine/machine.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/step_controller.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

/// The numbers of a lane, in this order. What a step changes: t, the number of rejections, the state of the
/// controller, then x and x′ (n numbers each). What it does not: those of `Given`, then p, then
/// rtol and atol (n numbers each).
namespace lane {
using Control = StepState<double>;
constexpr int t = 0, rejected = 1, control = 2, numbers = control + static_cast<int>(Control::fields.size());
/// Where the lane keeps a number of its controller.
constexpr int place(double Control::*field) {
  int k = control;
  for (auto other : Control::fields) {
    if (other == field) break;
    ++k;
  }
  return k;
}
constexpr int dt = place(&Control::dt), steps = place(&Control::accepted), hits = place(&Control::hits);
constexpr int repeated = place(&Control::repeated);
enum Given { end, next_stop, dt_max, dt_first, most_steps, given };
}  // namespace lane

/// The programs for one explicit ODE, one method and one number of lanes. Immutable; run() may be called by
/// several threads, each with arrays of its own. Number k of a lane lies at [lanes·k + lane].
class CompiledLaneStep {
 public:
  /// Nothing where there is no machine code for so many lanes or it would be long (`longest` instructions).
  /// Remembered for equal equations, method and lanes. watch: a lane whose steps stability limits
  /// needs attention.
  /// Requires x′ = f(t, x, p) and an explicit method with an embedded one.
  static std::shared_ptr<const CompiledLaneStep> make(const Problem& problem, const Tableau& rk, bool watch,
                                                      int lanes);
  static constexpr std::size_t longest = 20'000;

  int lanes() const { return lanes_; }
  /// A lane whose steps stability limits is to be given up.
  bool watches_stiffness() const { return watch_; }
  int n() const { return n_; }
  int parameters() const { return p_; }
  /// Positions of numbers in the state of a lane.
  int x() const { return lane::numbers; }
  int xdot() const { return x() + n_; }
  int changing() const { return xdot() + n_; }  ///< how many numbers a step changes
  int of(lane::Given g) const { return changing() + g; }
  int p() const { return of(lane::given); }
  int rtol() const { return p() + p_; }
  int atol() const { return rtol() + n_; }
  int size() const { return atol() + n_; }

  /// state: size() numbers per lane. out: the changing() numbers after the attempt, then 1
  /// where the lane needs attention: next_stop or most_steps was reached, the step size has
  /// vanished, or stability limits the steps.
  void step(const double* state, double* out, double* work) const { step_->run(state, out, work); }
  /// x′ and a first step from t, x and what is given; changing() numbers.
  void start(const double* state, double* out, double* work) const { start_->run(state, out, work); }
  /// In: h, t, x, x′, p. Out: x and x′ at t + h, 2n numbers.
  void between(const double* in, double* out, double* work) const { between_->run(in, out, work); }
  std::size_t workspace_size() const;

 private:
  std::unique_ptr<const codegen::Machine> step_, start_, between_;
  int lanes_ = 1, n_ = 0, p_ = 0;
  bool watch_ = false;
};

}  // namespace pendula::integrate
