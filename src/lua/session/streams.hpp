// Files that scripts read: Ctrl-C ends a read, also of a device that gives bytes for ever or of a pipe that gives none.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Replaces io.open, io.lines and io.input.
void open_streams(lua_State* L);

}  // namespace pendula::lua
