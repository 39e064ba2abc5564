// Functions of Lua's standard library that run in C for as long as their arguments are large: with the same
// results, but Ctrl-C stops them.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// The original is upvalue 1, a C function without upvalues of its own: called in this frame, its errors
/// carry the name under which the user called it.
inline int call_original(lua_State* L) { return lua_tocfunction(L, lua_upvalueindex(1))(L); }

/// After the standard libraries: table.sort, move, insert and remove; string.rep, upper, lower and reverse;
/// setmetatable, so that finalizers can be interrupted too.
void open_long_calls(lua_State* L);

}  // namespace pendula::lua
