// The one place where C++ exceptions become Lua errors. Lua is linked as C++, so lua_error unwinds with an
// exception of its own and destructors run; the rule left is: never write catch (...) around a Lua call.
#pragma once

#include <string>
#include <string_view>

#include <lua.hpp>

#include "lua/core/call.hpp"

namespace pendula::lua {

/// Throws where the call on the stack has arguments that no form of the function takes: norm(b, 1)
/// must not be taken for norm(b). `count` is the index of the upvalue that keeps how many there are at
/// most; -1 before the first call.
void refuse_more_arguments(lua_State* L, std::string_view name, std::string_view signature, int count);

/// Pushes the function of a row. `row` must live as long as the state (the rows of a Module do).
void push_row(lua_State* L, const Row& row);

/// The name a row goes by in messages: "reduce" for "model:reduce", "rk.gauss", "+" for "expr:__add".
std::string shown_name(const std::string& row_name);

/// "exam.lua:12: " for the innermost frame that is the user's: not C, not the
/// embedded stdlib. "" if there is none.
std::string user_position(lua_State* L);

/// The text of any error value: a string as it is; a value with __tostring by that; else what it is.
std::string error_text(lua_State* L, int index);
/// Rewrites an error at a line of the stdlib ("stdlib/x.lua:7: attempt to …") about the call in
/// the user's file that led there; other messages as they are. To be called in a message handler,
/// while that call is on the stack.
std::string blamed_on_caller(lua_State* L, const std::string& message);

/// "\n  called from exam.lua:20" for every line of the user's files that led to the innermost one, also from
/// inside a callback that raised `message` and is no longer on the stack.
std::string callers(lua_State* L, const std::string& message);
/// The message handler of protected_call: remembers the error value beside its text, so that a table
/// raised by a callback arrives at the pcall outside as the same table, and its callers, as the stack
/// does not outlive the callback.
int keep_error(lua_State* L);

/// Runs `body` and turns exceptions into Lua errors "position + message".
int guard(lua_State* L, int (*body)(lua_State*));

/// A lua_CFunction that may throw. For infrastructure; bindings are rows.
template <int (*body)(lua_State*)>
int guarded(lua_State* L) {
  return guard(L, body);
}

}  // namespace pendula::lua
