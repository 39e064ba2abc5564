// Monitors inspect steps that have passed the error test. There are two kinds, since they are asked different
// questions at different times; plan/run_monitors.hpp has the lists that a run asks.
//
// A Monitor ends a run where its solution leaves the domain of the equations. A step-size control cannot be
// relied on for this: equations are usually solvable again behind a singular point, and a step that jumps
// over it passes the error test. A Monitor is asked after a step is kept and its events have happened, and
// may name an earlier time:
//
//   singularity_monitor   a divisor changes its sign or touches 0          (fixed steps)
//   tangency_monitor      a divisor had a minimum that is 0 within the tolerance
//   root_branch_monitor   y = -√D of a reduced form should continue as +√D
//   rank_monitor          constraints become dependent, or a block of equations singular
//   choice_monitor        the states that a form chose no longer determine the rest, within the tolerances
//
// With chosen steps, zeros of divisors are events with a termination_reason (events.hpp): they must be
// ordered in time with the user's events inside a step.
//
// A StepMonitor rejects a step whose error estimate cannot be trusted, because something lies between the
// stages. It is asked before the events of the step are located, which a wrong step would misplace:
//
//   domain_monitor        a pole of the equations as they are written; shorter steps end before it
//   switch_monitor        tanh v and the like in a long step; the step is made to end there
//   peak_monitor          a narrow peak of the equations; shorter steps resolve it
#pragma once

#include <optional>
#include <string>

#include "integrate/problem/problem.hpp"
#include "integrate/solve/stats.hpp"

namespace pendula::integrate {

/// Where and why a run ends.
struct Stop {
  double t;            ///< the solution is valid before it
  std::string reason;  ///< "x = 0 there, and …"
  double known;        ///< the last time the run certainly holds a point for, if it does not keep its steps
};

/// An accepted step, as a monitor sees it.
struct MonitoredStep {
  const Point& before;
  const Point& here;
  bool last;           ///< the run ends here
  const Stats& stats;  ///< of the run so far
};

/// The dense output between mesh points.
class StepInterpolation {
 public:
  virtual ~StepInterpolation() = default;
  /// The solution at a time of the run so far: x by the method's continuous extension, x′ and z by straight
  /// lines. False where the run does not keep its steps. Throws Failure.
  virtual bool interpolate(double t, Point& out) = 0;
  /// The same by the cubic of Hermite between the ends of the step, without an evaluation.
  virtual bool interpolate_roughly(double t, Point& out) = 0;
};

class Monitor {
 public:
  virtual ~Monitor() = default;
  /// The run begins at a point.
  virtual void start(const Point& point) = 0;
  /// The solution or the equations have jumped: earlier values are invalid. problem:
  /// in the modes of its branches that are in force now.
  virtual void restart(const ProblemPtr& problem) = 0;
  /// After every accepted step.
  virtual std::optional<Stop> after(const MonitoredStep& step) = 0;
};

/// Why a step must not be kept as it is.
struct Rejection {
  std::optional<double> until = {};  ///< it is to end at this time; none: shorter steps
  std::string reason = {};    ///< why the run ends before it, if it cannot be repeated; "": it is kept then
  double error = 0;           ///< of the step, in tolerances, if it is kept
  bool is_tolerated = false;  ///< too many have been repeated: it is kept
};

class StepMonitor {
 public:
  virtual ~StepMonitor() = default;
  /// The run begins at a point, or has jumped to it. problem: with its branches, as it is integrated now.
  virtual void restart(const ProblemPtr& problem, const Point& point) = 0;
  /// After every step that has passed the error test. Where it rejects the step, it stays at the beginning.
  virtual std::optional<Rejection> after(const ProblemPtr& problem, const Point& from, const Point& to) = 0;
  /// It has nothing to look for.
  virtual bool is_empty() const = 0;
};

/// The point a few roundings of t later, x along x′. The root of an expression that changes its sign up to
/// there cannot be distinguished from t.
Point a_moment_after(const Point& point);

}  // namespace pendula::integrate
