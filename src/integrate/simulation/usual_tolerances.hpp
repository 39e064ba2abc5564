// Tolerances of a run where none are asked for.
#pragma once

#include "integrate/problem/problem.hpp"
#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// 10⁻⁶, or what was asked for all unknowns.
double usual_rtol(const Simulation& simulation);

/// atol of every unknown (x, z): 10⁻³ rtol for unknowns whose size at the start is 0.1 … 1000, a hundredth of
/// the size times rtol below, a millionth of it above. x′ at the start tells a size unless it is gone after
/// a few millionths of the interval. Cost: where a size is above 1000, two evaluations of x′ and
/// natural_sizes().
Vec usual_atol(const Simulation& simulation, const ProblemPtr& problem, const Point& start);

/// Tolerances::time, n + m entries, of unknowns of index 2: no unit of time is special. 1 where sizes are not
/// known, and in models of index 3. Requires the index of every unknown (x, z). Cost: natural_sizes() and one
/// evaluation of x′ and its slopes.
Vec multiplier_times(const Simulation& simulation, const ProblemPtr& problem, const Point& start,
                     const std::vector<int>& index);

}  // namespace pendula::integrate
