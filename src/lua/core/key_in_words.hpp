// Keys of tables in messages.
#pragma once

#include <string>

#include <lua.hpp>

namespace pendula::lua {

/// A key as it is shown: names, numbers and objects by their text, others by their kind ("a function"), since
/// an address is meaningless and differs from run to run.
std::string key_in_words(lua_State* L, int index);

}  // namespace pendula::lua
