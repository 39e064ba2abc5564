// The interactive session: read · complete · evaluate · print.
#pragma once

#include <lua.hpp>

namespace pendula::shell {

/// Runs the session until Ctrl-D, exit or quit. The banner is shown to people only.
void run_session(lua_State* L);

}  // namespace pendula::shell
