// Redundant constraints: which of them a model keeps changes along the way.
//
// A mechanism of lagrange, or of independent(), whose constraints follow from others keeps as many as their
// rank (dae/regularise/least_norm). While it moves, the gradients of those kept may become dependent where
// all gradients together keep their rank: two of four parallel cranks when they point along the line between
// their pins. After every step the kept ones are compared with the best choice there; when they are much
// worse, the integration goes on with that choice, from the same point. All choices have the same
// coordinates, multipliers and leaves.
#pragma once

#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// Is this a model of lagrange or independent(), or a form of one, without some
/// constraints that follow from others?
bool leaves_out_constraints(const dae::ModelPtr& model);

/// As simulate(), which calls it.
TrajectoryPtr simulate_rekeeping(const dae::ModelPtr& model, const Simulation& simulation);

/// The same for a run with sensitivities, which keeps the constraints that it begins with: it ends where they
/// are nearly dependent, and says so.
TrajectoryPtr simulate_keeping(const dae::ModelPtr& model, const Simulation& simulation);

}  // namespace pendula::integrate
