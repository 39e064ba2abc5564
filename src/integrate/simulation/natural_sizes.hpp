// Relative sizes of the unknowns of a model, estimated from its equations.
//
// A model in metres whose angles are 10⁻³ and whose forces are 10⁹ is no more difficult than in
// other units. Which change of an unknown is negligible follows from its effect in the equations,
// not from the sizes of other unknowns.
#pragma once

#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// Sizes of the user's x and z at a start: sᵢ = c dᵢ with rows rₖ and a unit of time τ such that the terms
/// rₖ |∂Fₖ/∂yᵢ| dᵢ and rₖ |∂Fₖ/∂xᵢ′| dᵢ/τ are near 1 in the mean of their logarithms (Curtis & Reid, J. Inst.
/// Maths Applics 10, 1972), and c the least for which |yᵢ| ≤ sᵢ, |xᵢ′| ≤ sᵢ/τ; one c for each set of unknowns
/// that the equations connect. Other units of unknowns, equations and time change them as they change the
/// unknowns. 0 where nothing is known: unknowns at rest at 0, or models too large for the question.
Vec natural_sizes(Problem& problem, const Point& start, double from, double interval);

}  // namespace pendula::integrate
