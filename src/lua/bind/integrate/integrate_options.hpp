// The options of model:integrate and of what runs integrations: read once, here.
#pragma once

#include "lua/bind/dae/dae.hpp"
#include "lua/bind/integrate/integrate.hpp"

namespace pendula::lua {

/// The options that read_simulation knows.
const OptionTable& integrate_option_rows();

/// Everything that integrate needs, from a table of options. Throws Error naming the option.
integrate::Simulation read_simulation(Call& call, const Options& options, const dae::ModelPtr& model);

/// The option `method`: a tableau, the name of one in rk, or "radau", "gauss", "bdf", "rodas", "auto".
/// `fixed`: for fixed steps. Absent: "auto", or an error that asks for a tableau where steps are fixed.
/// model: whose integration it is for; without it "auto" is ready for any tolerance and size.
integrate::Method read_method(Call& call, const Options& options, bool fixed,
                              const dae::Model* model = nullptr);

/// "auto" with the methods of the library: those that a model of so many equations may need at this
/// tolerance, or all.
integrate::Method automatic_method(lua_State* L, std::optional<double> rtol = {}, std::size_t equations = 0);

}  // namespace pendula::lua
