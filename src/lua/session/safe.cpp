#include "lua/session/safe.hpp"

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "base/error.hpp"
#include "base/files/temporary.hpp"
#include "base/text.hpp"
#include "lua/core/table_text.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/screen/fit_text.hpp"
#include "lua/screen/pager.hpp"
#include "lua/session/long_calls.hpp"
#include "lua/session/numeric_calls.hpp"
#include "lua/session/patterns.hpp"
#include "lua/session/safe_calls.hpp"
#include "lua/session/streams.hpp"

namespace pendula::lua {

namespace {

/// Raises an error unless the mode at argument `i` admits text, and restricts it to "t": bytecode can crash
/// the virtual machine.
void text_only(lua_State* L, int i) {
  const char* mode = luaL_optstring(L, i, "t");
  if (!std::strchr(mode, 't')) luaL_error(L, "bytecode is not accepted, only Lua text (mode 't')");
  lua_pushliteral(L, "t");
  lua_replace(L, i);
}

/// load(chunk, name, mode, env). Upvalue: the original. An absent env must stay absent, since nil would
/// be an environment.
int safe_load(lua_State* L) {
  const int given = lua_gettop(L);
  if (given < 3) lua_settop(L, 3);
  text_only(L, 3);
  return lua_tocfunction(L, lua_upvalueindex(1))(L);  // in this frame, so that errors carry the caller's line
}

/// loadfile(name, mode, env). Upvalue: the original.
int safe_loadfile(lua_State* L) {
  if (lua_gettop(L) < 2) lua_settop(L, 2);
  text_only(L, 2);
  return lua_tocfunction(L, lua_upvalueindex(1))(L);
}

int dofile_results(lua_State* L, int, lua_KContext) { return lua_gettop(L) - 1; }

int safe_dofile(lua_State* L) {
  const char* name = luaL_optstring(L, 1, nullptr);
  lua_settop(L, 1);
  if (luaL_loadfilex(L, name, "t") != LUA_OK) return lua_error(L);
  lua_callk(L, 0, LUA_MULTRET, 0, dofile_results);
  return dofile_results(L, 0, 0);
}

/// os.exit([code]): flushes files and runs finalizers. Upvalue: the original.
int safe_exit(lua_State* L) {
  lua_settop(L, 1);
  if (lua_isnone(L, 1) || lua_isnil(L, 1)) {
    lua_pushboolean(L, 1);
    lua_replace(L, 1);
  }
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_pushboolean(L, 1);
  lua_call(L, 2, 0);
  return 0;
}

/// os.tmpname(): a new file, which is removed when the program ends.
int temporary_name(lua_State* L) {
  lua_pushstring(L, temporary_file().c_str());
  return 1;
}

/// Appends a value to a line. The lines of a matrix or model are aligned below the first one; after a long
/// text they begin on a new line.
void put_beside(std::string& line, std::string_view value, bool blank, bool tall) {
  if (blank) line += ' ';
  const std::size_t last = line.rfind('\n') + 1;  // npos + 1 is 0
  if (!tall || line.size() == last) {
    line += value;
    return;
  }
  constexpr int widest = 40;
  const int column = display_width(std::string_view(line).substr(last));
  if (column > widest) line.back() = '\n';
  for (const char c : value) {
    line += c;
    if (c == '\n' && column <= widest) line.append(static_cast<std::size_t>(column), ' ');
  }
}

/// print(…): values separated by blanks, with lists of results written out; on a terminal, values other than
/// strings are fitted to its width.
int print_values(lua_State* L) {
  const int count = lua_gettop(L);
  std::string line;
  bool only_strings = true, blank = false;
  for (int i = 1; i <= count; ++i) {
    const int type = lua_type(L, i);
    only_strings = only_strings && type != LUA_TUSERDATA && type != LUA_TTABLE;
    if (type == LUA_TSTRING) {
      std::size_t size = 0;
      const char* bytes = lua_tolstring(L, i, &size);
      put_beside(line, {bytes, size}, blank, false);
      blank = true;
    } else {
      const std::string shown = shown_text(L, i);
      const bool tall = shown.find('\n') != shown.npos;
      put_beside(line, shown, blank, tall);
      if (tall && i < count) line += '\n';
      blank = !tall;
    }
    lua_settop(L, count);
  }
  const ScreenSize screen = screen_size();
  if (screen.columns > 0 && !only_strings) line = fitted(line, screen.columns);
  show_text(line + "\n");
  return 0;
}

/// os.setlocale(…), but numbers keep the decimal point in any locale, in files and in Lua source.
/// Upvalue: the original.
int safe_setlocale(lua_State* L) {
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, 1);
  std::setlocale(LC_NUMERIC, "C");
  return 1;
}

/// The searcher of require, restricted to Lua text along package.path. Upvalue: package.searchpath.
int search_text(lua_State* L) {
  luaL_checkstring(L, 1);
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_pushvalue(L, 1);
  lua_getglobal(L, "package");
  if (lua_getfield(L, -1, "path") != LUA_TSTRING) return luaL_error(L, "package.path must be a string");
  lua_remove(L, -2);
  lua_call(L, 2, 2);
  if (lua_isnil(L, -2)) return 1;  // the list of files that were tried
  lua_pop(L, 1);
  const std::string file = lua_tostring(L, -1);
  if (luaL_loadfilex(L, file.c_str(), "t") != LUA_OK) return lua_error(L);
  lua_pushstring(L, file.c_str());
  return 2;
}

/// Replaces the function table[name] of the table on top by a closure with the original as upvalue.
void wrap_field(lua_State* L, const char* name, lua_CFunction function) {
  lua_getfield(L, -1, name);
  lua_pushcclosure(L, function, 1);
  lua_setfield(L, -2, name);
}

void remove_fields(lua_State* L, const char* table, std::initializer_list<const char*> names) {
  lua_getglobal(L, table);
  for (const char* name : names) {
    lua_pushnil(L);
    lua_setfield(L, -2, name);
  }
  lua_pop(L, 1);
}

void secure_package(lua_State* L) {
  lua_getglobal(L, "package");
  lua_getfield(L, -1, "searchers");
  lua_getfield(L, -2, "searchpath");
  lua_pushcclosure(L, guarded<search_text>, 1);
  lua_rawseti(L, -2, 2);
  for (int i = 3; i <= 4; ++i) {
    lua_pushnil(L);
    lua_rawseti(L, -2, i);
  }
  const char* home = std::getenv("HOME");  // the user's own files, available to every script
  const std::string own = home && *home ? std::string(home) + "/.local/share/pendula/?.lua" : "";
  const std::string path = "./?.lua;./?/init.lua" + (own.empty() ? "" : ";" + own);
  lua_pushlstring(L, path.data(), path.size());
  lua_setfield(L, -3, "path");
  lua_pop(L, 2);
  remove_fields(L, "package", {"loadlib", "cpath"});
}

/// Reduces debug to its two harmless functions, also for require.
void secure_debug(lua_State* L) {
  lua_getglobal(L, "debug");
  lua_createtable(L, 0, 2);
  for (const char* name : {"traceback", "getinfo"}) {
    lua_getfield(L, -2, name);
    lua_setfield(L, -2, name);
  }
  lua_getfield(L, LUA_REGISTRYINDEX, LUA_LOADED_TABLE);
  lua_pushvalue(L, -2);
  lua_setfield(L, -2, "debug");
  lua_pop(L, 1);
  lua_setglobal(L, "debug");
  lua_pop(L, 1);
}

}  // namespace

void open_safe_libraries(lua_State* L) {
  luaL_openlibs(L);
  open_safe_calls(L);
  open_numeric_calls(L);
  open_patterns(L);
  open_long_calls(L);
  open_streams(L);
  lua_pushglobaltable(L);
  wrap_field(L, "load", safe_load);
  lua_pushcfunction(L, guarded<print_values>);
  lua_setfield(L, -2, "print");
  wrap_field(L, "loadfile", safe_loadfile);
  lua_pushcfunction(L, safe_dofile);
  lua_setfield(L, -2, "dofile");
  lua_getfield(L, -1, "os");
  wrap_field(L, "exit", safe_exit);
  wrap_field(L, "setlocale", safe_setlocale);
  lua_pushcfunction(L, guarded<temporary_name>);
  lua_setfield(L, -2, "tmpname");
  lua_pop(L, 2);
  remove_fields(L, "string", {"dump"});
  secure_package(L);
  secure_debug(L);
  lua_pushliteral(L, "");
  lua_getmetatable(L, -1);
  lua_pushliteral(L, "string");
  lua_setfield(L, -2, "__metatable");
  lua_pop(L, 2);
}

}  // namespace pendula::lua
