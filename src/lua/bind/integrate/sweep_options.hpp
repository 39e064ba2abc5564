// The options of sweep: what varies from run to run, and what all runs have in common.
#pragma once

#include "integrate/sweep/sweep.hpp"
#include "lua/core/call.hpp"
#include "random/sample_space.hpp"

namespace pendula::lua {

/// The options of integrate and those of the sweep itself.
const OptionTable& sweep_option_rows();

/// Reads sweep(model, options). `space`: the values of what varies. Throws Error naming the option; nothing
/// that concerns single runs is an error here as long as one of them can be started.
integrate::SweepRequest read_sweep(Call& call, std::shared_ptr<const random::SampleSpace>& space);

}  // namespace pendula::lua
