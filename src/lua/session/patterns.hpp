#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Replaces string.find, match, gmatch and gsub by functions of the same results (Lua 5.4 Reference Manual
/// §6.4.1) that Ctrl-C stops: a pattern such as ".-.-.-.-b" can take years.
void open_patterns(lua_State* L);

}  // namespace pendula::lua
