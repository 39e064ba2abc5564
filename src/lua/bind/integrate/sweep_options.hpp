// The options of sweep: what varies from run to run, and what all runs have in common.
#pragma once

#include "integrate/sweep/sweep.hpp"
#include "lua/core/call.hpp"

namespace pendula::lua {

/// A list of values that one parameter or initial value runs through.
struct SweepAxis {
  std::string name;
  std::vector<double> values;  ///< one per run
};
/// Reads sweep(model, options). Throws Error naming the option; nothing that concerns single runs is an error
/// here as long as one of them can be started.
integrate::SweepRequest read_sweep(Call& call, std::vector<SweepAxis>& axes);

}  // namespace pendula::lua
