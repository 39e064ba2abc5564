// The driver for steps of a fixed length.
#pragma once

#include "integrate/plan/plan.hpp"
#include "integrate/solution/solution.hpp"
#include "integrate/step/runge_kutta.hpp"

namespace pendula::integrate {

/// Steps tₖ = from + k dt; the last one is shortened to end at `to`. start: x is taken as it is, x′ and z are
/// starting values of Newton's method (start.t is ignored). Requires plan.dt.
///
/// returns   the solution; when a step fails, a value is not finite or Ctrl-C is pressed, the part computed
///           so far, and its outcome says why
/// throws    Error on a bad plan (dt ≤ 0, to ≤ from, times); Failure when the start determines no x′ and z
///           (index above 1) or Newton finds none; what an input function throws
/// cost      per step of an s-stage fully implicit method: O((s(n + m))³) per Newton iteration
SolutionPtr integrate(ProblemPtr problem, TableauPtr tableau, Point start, const Plan& plan);

}  // namespace pendula::integrate
