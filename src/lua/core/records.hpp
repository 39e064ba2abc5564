// Results made by the Lua stdlib: a table behind the face of an object, so that it has a type name, methods
// and fields (rows "convergence:plot", "convergence#slopes"), a help page and a print of its own.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Adds to the environment of the stdlib (after open_library):
///   record(type, table)   an object of that type
///   contents(type, object) its table; an error if it is of another type
void open_records(lua_State* L);

}  // namespace pendula::lua
