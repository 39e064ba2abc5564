#include "lua/session/state.hpp"

#include <cstdio>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "base/interrupt.hpp"
#include "expr/polynomial/exact_memory.hpp"
#include "lua/bind/modules.hpp"
#include "lua/core/documentation.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/library.hpp"
#include "lua/core/memory.hpp"
#include "lua/core/records.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"
#include "lua/document/document.hpp"
#include "lua/session/folders.hpp"
#include "lua/session/safe.hpp"

namespace pendula::lua {

namespace {

/// Reached only by an error outside every protected call, which would be an internal error; Lua
/// aborts after it.
int panic(lua_State* L) {
  std::fprintf(stderr, "pendula: internal error: %s (please report)\n", error_text(L, -1).c_str());
  return 0;
}

/// run_user(function, …): true; or false, the text of the error and whether it was Ctrl-C. For code between a
/// script and the terminal: reports, notebooks.
int run_user(lua_State* L) {
  luaL_checktype(L, 1, LUA_TFUNCTION);
  const bool good = run(L, lua_gettop(L) - 1, 0);
  lua_pushboolean(L, good);
  if (good) return 1;
  const bool stopped = is_interrupt(L, -2);
  if (stopped) interrupt_requested = false;
  if (stopped || !lua_isstring(L, -2)) {
    lua_pushstring(L, stopped ? "interrupted" : "an error without a text");
  } else {
    lua_pushvalue(L, -2);
  }
  lua_pushboolean(L, stopped);
  return 3;
}

void open_run_user(lua_State* L) {
  push_stdlib_environment(L);
  lua_pushcfunction(L, guarded<run_user>);
  lua_setfield(L, -2, "run_user");
  lua_pop(L, 1);
}

int open_everything(lua_State* L) {
  lua_gc(L, LUA_GCSTOP);
  open_safe_libraries(L);
  open_library(L);
  open_documentation(L);
  open_document(L);
  open_run_user(L);
  open_records(L);
  open_folders(L);
  for (const Module* module : modules()) add_module(L, *module);
  open_numbers(L);
  include_embedded(L, "init");
  lua_gc(L, LUA_GCRESTART);
  return 0;
}

/// Converts any raised value to a text for the user. Messages of the user's own lines pass unchanged; an
/// error of our stdlib is attributed to the user's line that called it.
int explain_error(lua_State* L) {
  if (is_interrupt_marker(L, 1)) return 1;
  std::string message = error_text(L, 1);
  const std::string lines = callers(L, message);
  // Lua gives no line if one of its C functions fails (table.sort).
  const bool bare = message.starts_with("C stack overflow") || message.starts_with("attempt to ") ||
                    message.starts_with("invalid order function");
  if (bare || lua_type(L, 1) != LUA_TSTRING) message = user_position(L) + message;
  message = blamed_on_caller(L, message) + lines;
  lua_pushlstring(L, message.data(), message.size());
  return 1;
}

/// Keeps freed memory in the process. Pages that the kernel provides again have to be cleared at one fault
/// each, which prolonged integrations of a millisecond by up to a half.
void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  // otherwise every larger request first consolidates the small free chunks: a sixth of a reduction
  mallopt(M_MXFAST, 0);
#endif
}

}  // namespace

lua_State* new_state() {
  keep_freed_memory();
  throw_when_exact_memory_ends();
  limit_process_memory();
  begin_session();
  lua_State* L = new_capped_state();
  if (!L) throw Error("not enough memory for a Lua state");
  lua_atpanic(L, panic);
  lua_pushcfunction(L, guarded<open_everything>);
  if (lua_pcall(L, 0, 0, 0) != LUA_OK) {
    const std::string message = error_text(L, -1);
    lua_close(L);
    throw Error(message);
  }
  return L;
}

bool is_interrupt(lua_State* L, int index) { return is_interrupt_marker(L, index); }

bool run(lua_State* L, int arguments, int results) {
  const int status = call_with_handler(L, guarded<explain_error>, arguments, results);
  if (status == LUA_ERRMEM) {
    const Reserve reserve(L);
    const std::string message = memory_message(L);
    lua_pop(L, 1);
    lua_pushlstring(L, message.data(), message.size());
  }
  return status == LUA_OK;
}

namespace {

int load_part(lua_State* L) {
  include_embedded(L, luaL_checkstring(L, 1));
  return 1;
}

}  // namespace

void search_script_folder(lua_State* L, const std::string& script) {
  const auto slash = script.rfind('/');
  if (slash == script.npos) return;
  const std::string folder = script.substr(0, slash + 1);
  lua_getglobal(L, "package");
  lua_getfield(L, -1, "path");
  const std::string path = folder + "?.lua;" + folder + "?/init.lua;" + lua_tostring(L, -1);
  lua_pushlstring(L, path.data(), path.size());
  lua_setfield(L, -3, "path");
  lua_pop(L, 2);
}

void push_part(lua_State* L, const std::string& name) {
  lua_pushcfunction(L, guarded<load_part>);
  lua_pushlstring(L, name.data(), name.size());
  if (run(L, 1, 1)) return;
  const std::string message = error_text(L, -1);
  lua_pop(L, 1);
  throw Error(message);
}

int run_tool(lua_State* L, const std::string& name, const std::vector<std::string>& arguments) {
  const int base = lua_gettop(L);
  push_part(L, name);
  lua_createtable(L, static_cast<int>(arguments.size()), 0);
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    lua_pushlstring(L, arguments[i].data(), arguments[i].size());
    lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
  }
  const bool good = run(L, 1, 1);
  if (!good && is_interrupt(L, -1)) throw Interrupted();
  if (!good) throw Error(lua_tostring(L, -1));
  const auto status = static_cast<int>(lua_tointeger(L, -1));
  lua_settop(L, base);
  return status;
}

}  // namespace pendula::lua
