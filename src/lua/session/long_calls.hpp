// Functions of Lua's standard library that run in C for as long as their arguments are large: with the same
// results, but Ctrl-C stops them.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// After the standard libraries: table.sort, move, insert and remove; string.rep, upper, lower and reverse;
/// setmetatable, so that finalizers can be interrupted too.
void open_long_calls(lua_State* L);

}  // namespace pendula::lua
