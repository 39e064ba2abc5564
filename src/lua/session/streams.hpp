// Files that scripts read and write: Ctrl-C ends a read, also of a device that gives bytes for ever or of a
// pipe that gives none, and a write that waits for a reader.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Replaces io.open, io.lines, io.input, io.write and the method write of files.
void open_streams(lua_State* L);

}  // namespace pendula::lua
