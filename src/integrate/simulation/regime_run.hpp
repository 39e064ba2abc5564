// Runs of piecewise models whose regimes differ in index: contact, ideal diodes (dae/start/regimes.hpp).
//
// While no min, max, abs or ifelse changes its side, the equations of one regime are integrated, reduced to
// index 1 where they have more. Where an inequality of the regime ends, the next consistent regime is
// searched and the states jump onto its constraints by the impulse that the equations imply. An event at that
// moment comes first: v → -e v is a law of restitution. Where events accumulate, as of a ball that comes to
// rest, the regime is left, too.
#pragma once

#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// A model as it was written, with regimes of different index, and a request that
/// can be followed through them.
bool changes_regime(const dae::Model& model, const Simulation& simulation);

/// As simulate(), which calls it. The solution's regimes_in_use() lists every switch.
TrajectoryPtr simulate_regimes(const dae::ModelPtr& model, const Simulation& simulation);

}  // namespace pendula::integrate
