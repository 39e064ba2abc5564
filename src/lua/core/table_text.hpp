// How values are shown, at the prompt and by print.
#pragma once

#include <string>

#include <lua.hpp>

namespace pendula::lua {

/// tostring(), except that a plain table is written as Lua would read it, {1, 2, x = 3}, cut short when it is
/// long, and that functions have no addresses.
std::string shown_text(lua_State* L, int index);

/// The table on top of the stack stays a list, and prints as `to_text` says. kind: a name of its own for
/// lists that print like this one.
void make_printing_list(lua_State* L, const char* kind, lua_CFunction to_text);

/// Texts for print have no line end; print adds one.
std::string without_newline(const std::string& lines);

}  // namespace pendula::lua
