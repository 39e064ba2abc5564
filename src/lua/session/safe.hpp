// Lua's standard libraries without the parts that can crash the process or swallow Ctrl-C.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Opens the standard libraries and replaces: pcall, xpcall, coroutine.resume/wrap/close (an interrupt passes
/// through), load, loadfile, dofile, require (text only), string.dump, package.loadlib (gone), debug
/// (traceback and getinfo stay), os.exit (always closes the state); the metatable of strings is hidden.
void open_safe_libraries(lua_State* L);

}  // namespace pendula::lua
