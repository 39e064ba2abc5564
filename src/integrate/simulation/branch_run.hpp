// Runs through points where branches of solutions meet: crossings, touched folds (dae/start/continuations.hpp).
//
// Where a run stops since the equations no longer determine x′ and z, the ways on are compared with what was asked for.
// The Taylor polynomial of the chosen one leads so far beyond the point that its last terms stay within the tolerance;
// from there the equations are regular again.
#pragma once

#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// "; solutions go on there with z′ = -1 or z′ = 1 …" of a run that stops at a point, "" where it is not known. here: what
/// stopped it names the place; else it may have stopped before one, whose time is then said.
std::string ways_on_text(const dae::ModelPtr& model, const Simulation& simulation, const Solution& solution,
                         const Point& point, bool here);

/// As simulate(), which calls it; requires simulation.branch. Throws Error for fixed steps and sensitivities.
TrajectoryPtr simulate_branches(const dae::ModelPtr& model, const Simulation& simulation);

}  // namespace pendula::integrate
