// States that no solution takes through 0: where all states of such a set are 0, so are their derivatives.
//
// x′ = x g(t, x, …) is the plainest one: a population, the prey of a predator, the infected; an exposed and
// an infectious class are a set of two. By uniqueness a solution that is not 0 stays so, however small it
// becomes: it grows again from what is left of it, and errors grow with it (solution/regrowth.hpp).
#pragma once

#include <vector>

#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// Sets of at most four states (their numbers in x, ascending), none of which contains another: x′ of them
/// vanishes, by the expressions and with slopes that are finite, wherever all of them are 0. Requires
/// equations in the form x′ = f(t, x, z, u, p), else none is found; sets of more than one are sought for up
/// to 40 states. Remembered for the equations; cost of the first call: nodes of f times the sets that are
/// tried, at most 30 for each state.
const std::vector<std::vector<int>>& invariant_zeros(const Problem& problem);

}  // namespace pendula::integrate
