#include "shell/completion/names.hpp"

namespace pendula::shell {

int push_global(lua_State* L, std::string_view name) {
  lua_pushglobaltable(L);
  lua_pushlstring(L, name.data(), name.size());
  const int type = lua_rawget(L, -2);
  lua_remove(L, -2);
  return type;
}

namespace {

/// Is the value the result of `require name`, such as string and math?
bool is_library(lua_State* L, int value, std::string_view name) {
  lua_getfield(L, LUA_REGISTRYINDEX, LUA_LOADED_TABLE);
  lua_pushlstring(L, name.data(), name.size());
  lua_rawget(L, -2);
  const bool same = lua_rawequal(L, -1, value);
  lua_pop(L, 2);
  return same;
}

}  // namespace

NameKind name_kind(lua_State* L, std::string_view name) {
  const int top = lua_gettop(L);
  NameKind kind = NameKind::unknown;
  if (push_global(L, name) != LUA_TNIL) {
    kind = NameKind::own;
    if (push_global(L, "pendula") == LUA_TTABLE) {
      lua_pushlstring(L, name.data(), name.size());
      lua_rawget(L, -2);
      if (lua_rawequal(L, -1, top + 1)) kind = NameKind::vocabulary;
    }
    if (lua_iscfunction(L, top + 1) || is_library(L, top + 1, name)) kind = NameKind::vocabulary;
  }
  lua_settop(L, top);
  return kind;
}

}  // namespace pendula::shell
