// Runs of form "array", whose rows and states are selected again along the solution.
//
// The rows of the derivative array that were chosen at one point need not determine the unknowns at
// another: a pendulum with the height as its state stands still at the lowest point. After every step
// the Jacobian of the chosen rows is compared with what it was where they were chosen, in the same
// units; where it has lost most of its regularity, or a step fails, they are chosen again there. The
// pieces make one solution in the unknowns of the first choice. Derivatives that only the first choice
// contains have no value (NaN) behind it.
#pragma once

#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// A model of form "array", and no event that resets what is a state of the first choice only.
bool chooses_rows(const dae::Model& model, const Simulation& simulation);

/// As simulate(), which calls it. The solution's states_in_use() lists every choice.
TrajectoryPtr simulate_rechoosing(const dae::ModelPtr& model, const Simulation& simulation);

}  // namespace pendula::integrate
