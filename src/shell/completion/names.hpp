// Global names at the prompt.
#pragma once

#include <lua.hpp>

#include <string>
#include <string_view>

namespace pendula::shell {

enum class NameKind {
  unknown,
  own,         ///< a variable of the session
  vocabulary,  ///< as the library defines it
};

/// Looks without calling anything: an undefined global is an error in Pendula.
NameKind name_kind(lua_State* L, std::string_view name);

/// Pushes the global, or nil if it is undefined.
int push_global(lua_State* L, std::string_view name);

}  // namespace pendula::shell
