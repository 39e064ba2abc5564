// What other bindings need to know about models and starts in Lua.
#pragma once

#include "dae/start.hpp"
#include "lua/values.hpp"

namespace pendula::lua {

template <> struct TypeName<dae::Model> { static constexpr const char* value = "model"; };
template <> struct TypeName<dae::Start> { static constexpr const char* value = "start"; };

/// Every leaf of the model and of its lineage that a user may name.
std::vector<Expr> known_leaves(const dae::Model& model);

/// { [p] = {1, 0, 0}, x = 1 } as leaf values.
dae::LeafValues read_leaf_values(lua_State* L, int index, const std::string& what, const dae::Model& model);

/// The options fix, guess, inputs, params, from.
dae::StartRequest read_start_request(lua_State* L, const Options& options, const dae::Model& model);

}  // namespace pendula::lua
