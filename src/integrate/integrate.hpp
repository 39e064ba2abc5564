// From a start to a solution with a fixed step.
#pragma once

#include <optional>
#include <vector>

#include "integrate/solution.hpp"

namespace pendula::integrate {

struct Plan {
  double from = 0, to = 0;
  double dt = 0;
  /// Ascending times inside [from, to] at which points are saved; every mesh point if absent. A time between
  /// two mesh points is reached by a shortened step of its own: the mesh does not depend on `times`.
  std::optional<std::vector<double>> times;
  bool direct = false;  ///< integrate a model of index 2 or more as it stands
};

/// Steps tₖ = from + k dt; the last one is shortened to end at `to`. start: x is taken as it is, x′ and z are
/// starting values of Newton's method (start.t is ignored).
///
/// returns   the solution; when a step fails, a value is not finite or Ctrl-C is pressed, the part computed
/// so far, and
///           status() says why
/// throws    Error on a bad plan (dt ≤ 0, to ≤ from, times); Failure when the start determines no x′ and z
/// (index above 1)
///           or Newton finds none; what an input function throws
/// cost      per step of an s-stage fully implicit method: O((s(n + m))³) per Newton iteration
SolutionPtr integrate(ProblemPtr problem, TableauPtr tableau, Point start, const Plan& plan);

}  // namespace pendula::integrate
