// Words that are commands at the prompt, as in a shell: `ls models` is ls "models" in Lua.
#pragma once

#include <lua.hpp>

#include <string>

namespace pendula::shell {

struct Command {
  std::string lua;     ///< what the entry means; "" if it is Lua already
  std::string script;  ///< what of it belongs into the script of a session
};

/// who, pwd, ls [folder], cd [folder], edit file, time <Lua>, reset, log "file". A variable of the session
/// goes before a command of its name, and so does whatever is Lua: `ls = 3`, `time(x)`.
Command command_of(lua_State* L, const std::string& entry);

}  // namespace pendula::shell
