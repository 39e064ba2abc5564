// Events as tables: { when =, direction =, action = "stop", reset = { [v] = … } }.
#pragma once

#include "lua/bind/dae/dae.hpp"

namespace pendula::lua {

/// { [v] = -0.9*v, … }: states and their values after an event. Throws Error: what is none of `known`, sizes.
std::vector<std::pair<Expr, Expr>> read_reset(lua_State* L, int index, std::span<const Expr> known,
                                              const std::string& what);

/// An event without its callback (field call, which is not read). Names in reset are those of `known`.
dae::Transition read_transition(lua_State* L, int table, std::span<const Expr> known,
                                const std::string& what);

}  // namespace pendula::lua
