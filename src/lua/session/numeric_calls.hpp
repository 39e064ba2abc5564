#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Gives the functions of math, string.format and tonumber exact numbers (√5, π/4, 1/3) as the doubles
/// nearest to them, and expressions with symbols an error that names the remedy.
void open_numeric_calls(lua_State* L);

}  // namespace pendula::lua
