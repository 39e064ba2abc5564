// A run whose states grow again from below their tolerances is made again with steps that follow them there.
#pragma once

#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// Of every state of the problem: may a run be repeated with another atol of it? Not where the caller gave
/// one, and where the run calls functions of the caller, which would be called twice. Empty: none.
std::vector<char> repeatable_states(const Simulation& simulation, const dae::Model& model,
                                    const Problem& problem);
/// The simulation with steps that keep rtol alone for the states that have grown again. Requires a solution
/// that ended so (Ending::regrowth).
Simulation following_small_states(const Simulation& simulation, const Solution& solution);

}  // namespace pendula::integrate
