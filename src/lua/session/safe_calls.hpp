#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Replaces pcall, xpcall and coroutine.resume, wrap, close by versions that do not catch an interrupt.
void open_safe_calls(lua_State* L);

}  // namespace pendula::lua
