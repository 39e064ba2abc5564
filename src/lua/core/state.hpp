// A ready Lua state: the standard libraries made safe, the vocabulary, strict globals, the embedded stdlib.
#pragma once

#include <lua.hpp>

#include <string>
#include <vector>

#include "lua/core/call.hpp"

namespace pendula::lua {

/// Ctrl-C: a SIGINT handler calls pendula::request_interrupt() (base/interrupt.hpp), which also stops Lua
/// loops; whoever reports the interruption clears interrupt_requested.
///
/// Opens a state with everything in it. Throws Error if memory is short. Cost: about 5 ms (the stdlib is
/// bytecode). The caller closes it with lua_close.
lua_State* new_state();

/// The list of binding modules (modules.cpp): the one place to register a new one.
const std::vector<const Module*>& modules();

/// Runs the function on top of the stack (below `arguments` arguments) with a traceback handler. True:
/// results are on the stack. False: the error text (or the interrupt marker) is on top.
bool run(lua_State* L, int arguments, int results);

/// Was the error value on top of the stack Ctrl-C?
bool is_interrupt(lua_State* L, int index);

}  // namespace pendula::lua
