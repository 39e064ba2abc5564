// What may be written as a name in Lua: a variable, a key before = in a table.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pendula {

/// The keywords of Lua 5.4, sorted.
const std::vector<std::string>& lua_keywords();

/// Letters, digits and _, not beginning with a digit, no keyword (Lua 5.4 Reference Manual §3.1).
bool is_lua_name(std::string_view word);

}  // namespace pendula
