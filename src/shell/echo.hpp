// The values of an entry, shown.
#pragma once

#include <lua.hpp>

namespace pendula::shell {

/// Shows the `count` values on top of the stack, separated by two blanks, and pops them; the
/// first is remembered in the global `ans`. Nils alone show nothing; a figure is drawn.
/// Called under protection: may raise Lua errors.
int echo_values(lua_State* L);

}  // namespace pendula::shell
