// States that no solution takes through 0: where all states of such a set are 0, so are their derivatives.
//
// x′ = x g(t, x, …) is the plainest one: a population, the prey of a predator, the infected; an exposed and
// an infectious class are a set of two. By uniqueness a solution that is not 0 stays so, however small it
// becomes: it grows again from what is left of it, and errors grow with it (solution/regrowth.hpp).
#pragma once

#include <vector>

#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// For each state a set that contains it, and none that it could do without (numbers in x, ascending; each
/// set once): x′ of the set vanishes, by the expressions and with slopes that are finite, wherever all of
/// it is 0. Requires equations in the form x′ = f(t, x, z, u, p), else none is found. Where a product is to
/// vanish, one factor or the other can: the search makes at most 30 such choices for each state, and misses
/// sets beyond them, and those that contain another one of more than 20 states. Remembered for the
/// equations; cost of the first call: at most 2000 looks at nodes of f and 20 more for each of them.
const std::vector<std::vector<int>>& invariant_zeros(const Problem& problem);

}  // namespace pendula::integrate
