// The values of an entry, shown.
#pragma once

#include <lua.hpp>

#include <string>

namespace pendula::shell {

/// Shows the `count` values on top of the stack, separated by tabs, and pops them; the first is remembered in
/// the global `ans`. Nils alone show nothing; a figure is drawn. Called under protection: may raise Lua
/// errors.
int echo_values(lua_State* L);

/// The text of a value: tostring(), except that a plain table is written as Lua would read it, {1, 2, x = 3},
/// cut short when it is long.
std::string echo_text(lua_State* L, int index);

}  // namespace pendula::shell
