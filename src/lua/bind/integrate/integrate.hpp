// What other bindings need to know about tableaus and solutions in Lua.
#pragma once

#include "integrate/simulation/simulate.hpp"
#include "lua/core/call.hpp"

namespace pendula::lua {

template <>
struct TypeName<integrate::Tableau> {
  static constexpr const char* value = "tableau";
};
template <>
struct TypeName<integrate::Trajectory> {
  static constexpr const char* value = "solution";
};

/// Keeps the options (argument 2) of the solution on top of the stack: sol.options.
void remember_options(lua_State* L);

}  // namespace pendula::lua
