#include "lua/session/forbidden_calls.hpp"

#include <cerrno>
#include <cstring>

#include "base/error.hpp"
#include "expr/polynomial/polynomial.hpp"
#include "lua/core/memory.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {

namespace {

using CallReporter = std::function<void(const std::string&)>;

const CallReporter& reporter_of(lua_State* L) {
  return *static_cast<const CallReporter*>(lua_touserdata(L, lua_upvalueindex(1)));
}

/// Reports a call and raises an error. Upvalues: report, the name of the call.
int refuse(lua_State* L) {
  const std::string name = lua_tostring(L, lua_upvalueindex(2));
  reporter_of(L)(name);
  throw Error(
      name +
      " is forbidden in safe mode: a script can neither start programs nor use files outside its folder");
}

/// Calls the original and reports failures. Upvalues: report, the name of the call, the original, whose third
/// result is the error number.
int watch(lua_State* L) {
  const int arguments = lua_gettop(L);
  const std::string file = arguments > 0 && lua_type(L, 1) == LUA_TSTRING ? lua_tostring(L, 1) : "";
  lua_pushvalue(L, lua_upvalueindex(3));
  lua_insert(L, 1);
  lua_call(L, arguments, LUA_MULTRET);
  if (lua_gettop(L) == 3 && lua_isnil(L, 1) &&
      (lua_tointeger(L, 3) == EACCES || lua_tointeger(L, 3) == EPERM))
    reporter_of(L)(text(lua_tostring(L, lua_upvalueindex(2)), " '", file, "'"));
  return lua_gettop(L);
}

/// The same for a function that raises its errors.
int watch_raised(lua_State* L) {
  const int arguments = lua_gettop(L);
  const std::string file = arguments > 0 && lua_type(L, 1) == LUA_TSTRING ? lua_tostring(L, 1) : "";
  lua_pushvalue(L, lua_upvalueindex(3));
  lua_insert(L, 1);
  if (lua_pcall(L, arguments, LUA_MULTRET, 0) == LUA_OK) return lua_gettop(L);
  const std::string message = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
  if (message.find(std::strerror(EACCES)) == message.npos || file.empty()) return lua_error(L);
  reporter_of(L)(text(lua_tostring(L, lua_upvalueindex(2)), " '", file, "'"));
  throw Error(message);
}

void replace(lua_State* L, const char* library, const char* function, const CallReporter& report,
             lua_CFunction by) {
  lua_getglobal(L, library);
  lua_pushlightuserdata(L, const_cast<CallReporter*>(&report));
  lua_pushstring(L, text(std::strcmp(library, "_G") == 0 ? "" : text(library, "."), function).c_str());
  lua_getfield(L, -3, function);
  lua_pushcclosure(L, by, 3);
  lua_setfield(L, -2, function);
  lua_pop(L, 1);
}

}  // namespace

void forbid_calls(lua_State* L, const CallReporter& report, std::size_t memory) {
  have_polynomials();  // loads FLINT while files can be opened: solve, factor and roots need it
  for (const char* function : {"execute", "tmpname"}) replace(L, "os", function, report, guarded<refuse>);
  for (const char* function : {"popen", "tmpfile"}) replace(L, "io", function, report, guarded<refuse>);
  for (const char* function : {"remove", "rename"}) replace(L, "os", function, report, watch);
  replace(L, "io", "open", report, watch);
  for (const char* function : {"lines", "input", "output"})
    replace(L, "io", function, report, guarded<watch_raised>);
  replace(L, "_G", "dofile", report, guarded<watch_raised>);
  lua_pushglobaltable(L);
  lua_pushliteral(L, "debug");
  lua_pushnil(L);
  lua_rawset(L, -3);
  lua_getfield(L, LUA_REGISTRYINDEX, LUA_LOADED_TABLE);
  lua_pushnil(L);
  lua_setfield(L, -2, "debug");
  lua_pop(L, 2);
  set_memory_cap(L, memory);
}

}  // namespace pendula::lua
