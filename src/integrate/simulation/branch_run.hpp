// Runs through points where branches of solutions meet: crossings, touched folds
// (dae/start/continuations.hpp).
//
// Where a run stops because the equations no longer determine x′ and z, the solutions that go on are compared
// with the branch that was asked for. The Taylor polynomial of the chosen one is followed beyond the point as
// far as its last terms stay within the tolerance; there the equations are regular again.
#pragma once

#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// "; solutions go on there with z′ = -1 or z′ = 1 …" for a run that has stopped; "" where this is not
/// known. here: the reason for the stop names the place; else the run may have stopped before such a
/// place, whose time is then given.
std::string continuations_at_end_text(const dae::ModelPtr& model, const Simulation& simulation,
                                      const Solution& solution, const Point& point, bool here);

/// As simulate(), which calls it; requires simulation.branch. Throws Error for fixed steps and sensitivities.
TrajectoryPtr simulate_branches(const dae::ModelPtr& model, const Simulation& simulation);

}  // namespace pendula::integrate
