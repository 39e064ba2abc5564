// Explicit steps with step size control for several parameter sets at once, as straight-line machine code.
//
// Every lane has its own t, dt, error estimate and decision: a step that is not accepted leaves the lane's
// state as it was, with a smaller dt. Nothing a lane computes depends on the others. The rules are those of
// explicit_stepper.hpp: error norm, controller, first step, stiffness test.
#pragma once

#include <memory>
#include <vector>

#include "codegen/machine/machine.hpp"
#include "integrate/problem/problem.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

/// The numbers of a lane, in this order. What a step changes: those of `Number`, then x and x′ (n numbers
/// each). What it does not: those of `Given`, then p, then rtol and atol (n numbers each).
namespace lane {
enum Number { t, dt, log_error, was_rejected, steps, rejected, hits, calm, numbers };
enum Given { end, look_at, dt_max, dt_first, most_steps, given };
}  // namespace lane

/// The programs for one explicit ODE, one method and one number of lanes. Immutable; run() may be called by
/// several threads, each with arrays of its own. Number k of a lane lies at [lanes·k + lane].
class LaneCode {
 public:
  /// Nothing where there is no machine code for so many lanes or it would be long (`longest` instructions).
  /// Remembered for equal equations, method and lanes. watch: for stiffness.
  /// Requires x′ = f(t, x, p) and an explicit method with an embedded one.
  static std::shared_ptr<const LaneCode> make(const Problem& problem, const Tableau& rk, bool watch,
                                              int lanes);
  static constexpr std::size_t longest = 20'000;

  int lanes() const { return lanes_; }
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

  /// state: size() numbers per lane. out: the changing() numbers after the attempt, then 1 where the lane
  /// needs attention: look_at or most_steps was reached, the step size has vanished, or stability limits the
  /// steps.
  void step(const double* state, double* out, double* work) const { step_->run(state, out, work); }
  /// x′ and a first step from t, x and what is given; changing() numbers.
  void start(const double* state, double* out, double* work) const { start_->run(state, out, work); }
  /// In: h, t, x, x′, p. Out: x and x′ at t + h, 2n numbers.
  void between(const double* in, double* out, double* work) const { between_->run(in, out, work); }
  std::size_t workspace_size() const;

  static constexpr int enough_hits = 25;

 private:
  std::unique_ptr<const codegen::Machine> step_, start_, between_;
  int lanes_ = 1, n_ = 0, p_ = 0;
};

}  // namespace pendula::integrate
