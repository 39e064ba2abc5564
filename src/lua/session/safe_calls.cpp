// pcall, xpcall and coroutines for scripts, as in lbaselib.c and lcorolib.c, except that the interrupt marker
// is raised again instead of returned to the script.
#include "lua/session/safe_calls.hpp"

#include <optional>

#include "lua/core/interrupts.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {

namespace {

/// Returns from a protected call. `extra`: stack slots below the results.
int finish(lua_State* L, int status, lua_KContext extra) {
  if (status != LUA_OK && status != LUA_YIELD) {
    if (is_interrupt_marker(L, -1)) return lua_error(L);
    lua_pushboolean(L, 0);
    lua_pushvalue(L, -2);
    return 2;
  }
  return lua_gettop(L) - static_cast<int>(extra);
}

/// The message handler of pcall, which hides lines of the stdlib.
int hide_stdlib_position(lua_State* L) {
  if (lua_type(L, 1) != LUA_TSTRING) return 1;
  const std::string message = blamed_on_caller(L, lua_tostring(L, 1));
  lua_pushlstring(L, message.data(), message.size());
  return 1;
}

int safe_pcall(lua_State* L) {
  luaL_checkany(L, 1);
  lua_pushcfunction(L, guarded<hide_stdlib_position>);
  lua_insert(L, 1);
  lua_pushboolean(L, 1);
  lua_insert(L, 2);
  return finish(L, lua_pcallk(L, lua_gettop(L) - 3, LUA_MULTRET, 1, 1, finish), 1);
}

/// Calls the user's message handler (upvalue), except for interrupts.
int handler_without_interrupts(lua_State* L) {
  if (is_interrupt_marker(L, 1)) return 1;
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, 1);
  return 1;
}

int safe_xpcall(lua_State* L) {
  luaL_checktype(L, 2, LUA_TFUNCTION);
  lua_pushvalue(L, 2);
  lua_pushcclosure(L, handler_without_interrupts, 1);
  lua_replace(L, 2);
  lua_pushboolean(L, 1);
  lua_pushvalue(L, 1);
  lua_rotate(L, 3, 2);
  return finish(L, lua_pcallk(L, lua_gettop(L) - 4, LUA_MULTRET, 2, 2, finish), 2);
}

/// Resumes `co` with `arguments` values from the top of L. Returns the number of results moved to L, or
/// nothing with the error value on top.
std::optional<int> resume(lua_State* L, lua_State* co, int arguments) {
  if (!lua_checkstack(co, arguments)) {
    lua_pushliteral(L, "too many arguments to resume");
    return {};
  }
  lua_xmove(L, co, arguments);
  int results = 0;
  int status = LUA_OK;
  {
    const Running running(co);
    status = lua_resume(co, L, arguments, &results);
  }
  if (status == LUA_OK || status == LUA_YIELD) {
    if (!lua_checkstack(L, results + 1)) {
      lua_pop(co, results);
      lua_pushliteral(L, "too many results to resume");
      return {};
    }
    lua_xmove(co, L, results);
    return results;
  }
  lua_xmove(co, L, 1);
  if (is_interrupt_marker(L, -1)) lua_error(L);
  return {};
}

lua_State* coroutine_argument(lua_State* L) {
  lua_State* co = lua_tothread(L, 1);
  luaL_argexpected(L, co, 1, "coroutine");
  return co;
}

int safe_resume(lua_State* L) {
  lua_State* co = coroutine_argument(L);
  const auto results = resume(L, co, lua_gettop(L) - 1);
  lua_pushboolean(L, results.has_value());
  if (!results) {
    lua_insert(L, -2);
    return 2;
  }
  lua_insert(L, -(*results + 1));
  return *results + 1;
}

/// The function returned by coroutine.wrap. Errors propagate unchanged: they name their own line, and a
/// second position (as in lcorolib.c) would mislead.
int wrapped(lua_State* L) {
  lua_State* co = lua_tothread(L, lua_upvalueindex(1));
  const auto results = resume(L, co, lua_gettop(L));
  if (results) return *results;
  const int status = lua_status(co);
  if (status != LUA_OK && status != LUA_YIELD) {  // after an error, run the pending to-be-closed variables
    if (lua_resetthread(co) != LUA_OK) lua_xmove(co, L, 1);
    if (is_interrupt_marker(L, -1)) return lua_error(L);
  }
  return lua_error(L);
}

int safe_wrap(lua_State* L) {
  luaL_checktype(L, 1, LUA_TFUNCTION);
  lua_State* co = lua_newthread(L);
  lua_pushvalue(L, 1);
  lua_xmove(L, co, 1);
  lua_pushcclosure(L, wrapped, 1);
  return 1;
}

/// coroutine.close, whose __close handlers may be interrupted. Upvalue: the original.
int safe_close(lua_State* L) {
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
  if (lua_gettop(L) == 2 && is_interrupt_marker(L, 2)) return lua_error(L);
  return lua_gettop(L);
}

}  // namespace

void open_safe_calls(lua_State* L) {
  lua_register(L, "pcall", safe_pcall);
  lua_register(L, "xpcall", safe_xpcall);
  lua_getglobal(L, "coroutine");
  lua_pushcfunction(L, safe_resume);
  lua_setfield(L, -2, "resume");
  lua_pushcfunction(L, safe_wrap);
  lua_setfield(L, -2, "wrap");
  lua_getfield(L, -1, "close");
  lua_pushcclosure(L, safe_close, 1);
  lua_setfield(L, -2, "close");
  lua_pop(L, 1);
}

}  // namespace pendula::lua
