// A session: a Lua state with the standard libraries made safe, the vocabulary of all bindings, strict
// globals and the embedded stdlib; how code runs in it; the test runner. lua/core below knows neither the
// bindings nor the stdlib's files, and the shell above knows only this folder.
//
// safe.hpp, safe_calls.hpp, patterns.hpp, long_calls.hpp, streams.hpp: Lua's functions that could crash the
// process or swallow Ctrl-C, made anew; forbidden_calls.hpp: those that untrusted scripts do not get;
// numeric_calls.hpp: those that take symbols, too; folders.hpp, testing.hpp, answers.hpp: what
// stdlib/session.lua, tests and grading need.
#pragma once

#include <string>
#include <vector>

#include <lua.hpp>

namespace pendula::lua {

/// Ctrl-C: a SIGINT handler calls pendula::request_interrupt() (base/interrupt.hpp), which also stops Lua
/// loops; whoever reports the interruption clears interrupt_requested.
///
/// Opens a state with everything in it. Throws Error if memory is short. Cost: about 5 ms (the stdlib is
/// bytecode). The caller closes it with lua_close.
lua_State* new_state();

/// Runs the function on top of the stack (below `arguments` arguments) with a traceback handler. True:
/// results are on the stack. False: the error text (or the interrupt marker) is on top.
bool run(lua_State* L, int arguments, int results);

/// What the script requires may stand beside it, wherever it was called from.
void search_script_folder(lua_State* L, const std::string& script);

/// Pushes what the file stdlib/<name>.lua returns. Throws Error.
void push_part(lua_State* L, const std::string& name);

/// Runs a tool of the program that is written in Lua: the file stdlib/<name>.lua returns a function, which
/// gets the arguments as a list. The exit status it returns. Throws Error with the text of what went
/// wrong, Interrupted after Ctrl-C.
int run_tool(lua_State* L, const std::string& name, const std::vector<std::string>& arguments);

/// Was the error value on top of the stack Ctrl-C?
bool is_interrupt(lua_State* L, int index);

}  // namespace pendula::lua
