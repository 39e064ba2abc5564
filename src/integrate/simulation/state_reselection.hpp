// Form "dummy": the choice of states changes along the way.
//
// A choice of dummy derivatives is good near a point. While a solution moves, the constraint Jacobian of the
// chosen dummies may lose its regularity (a pendulum that turns from hanging down to the side). After every
// step the choice in use is compared with the best one there; when it is clearly worse (hysteresis), the
// integration goes on with the best one, from the same point. All choices have the same leaves, as states or
// as algebraic variables, so that the pieces make one solution in the unknowns of the first model.
#pragma once

#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// A model of form "dummy".
bool chooses_states(const dae::Model& model);

/// As simulate(), which calls it. The solution's states_in_use() lists every switch.
TrajectoryPtr simulate_reselecting(const dae::ModelPtr& model, const Simulation& simulation);

}  // namespace pendula::integrate
