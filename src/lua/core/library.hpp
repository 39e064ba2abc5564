// The vocabulary: every row and every function that the Lua stdlib
// documents, in the table `pendula` and in _G.
#pragma once

#include <string>
#include <vector>

#include <lua.hpp>

#include "lua/core/call.hpp"

namespace pendula::lua {

/// Makes the tables `pendula` and _G strict and the environment of the stdlib.
/// Call once, after the standard libraries.
void open_library(lua_State* L);

/// Registers all rows of a module, which must live as long as the state.
void add_module(lua_State* L, const Module& module);

/// The modules added so far, in order.
std::vector<const Module*> added_modules(lua_State* L);

/// Pops a value and gives it the name of a row ("sin", "rk.gauss",
/// "model:plot", "model#energy", "model:__call").
void install(lua_State* L, const std::string& name);

/// Pops a function that makes the value of the library entry `name` ("rk.dop853") when it is first touched.
void install_lazy(lua_State* L, const std::string& name);

/// Pushes what a row name stands for; nil if there is nothing.
void push_named(lua_State* L, const std::string& name);

/// Pushes the environment of stdlib chunks: the vocabulary and the standard libraries as they were at
/// start-up, so that a script may shadow any name without harm to the library.
void push_stdlib_environment(lua_State* L);

/// The names a global lookup can find now, for "did you mean" and completion.
std::vector<std::string> global_names(lua_State* L);
/// Pushes an entry of the vocabulary, whatever the user's variable of that name is; nil if there is none.
void push_vocabulary(lua_State* L, const std::string& name);

/// Is there a global function of the vocabulary by this name?
bool is_vocabulary_function(lua_State* L, const std::string& name);

/// Runs the embedded file stdlib/<name>.lua; its one result is left on the stack.
/// Throws Error if there is no such file.
void include_embedded(lua_State* L, const std::string& name);

}  // namespace pendula::lua
