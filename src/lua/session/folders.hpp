// Folders, for the functions of stdlib/session.lua.
#pragma once

struct lua_State;

namespace pendula::lua {

/// working_folder(), change_folder(name), folder_names(name) in the environment of the stdlib. They throw
/// Error with the reason of the operating system.
void open_folders(lua_State* L);

}  // namespace pendula::lua
