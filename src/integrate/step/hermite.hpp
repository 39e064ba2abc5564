// A point inside a step from the points at its ends.
#pragma once

#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// Cubic Hermite interpolation of x and its slope x′, at a share of the step; z linear:
/// docs/derivations.md#dense-output. Requires to.t ≠ from.t.
void hermite(const Point& from, const Point& to, double share, Point& out);

}  // namespace pendula::integrate
