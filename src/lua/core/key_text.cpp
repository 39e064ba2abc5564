#include "lua/core/key_text.hpp"

#include "lua/core/call.hpp"

namespace pendula::lua {

std::string key_text(lua_State* L, int index) {
  const bool plain = luaL_getmetafield(L, index, "__tostring") == LUA_TNIL;
  if (!plain) lua_pop(L, 1);
  const int type = lua_type(L, index);
  if (plain && type != LUA_TSTRING && type != LUA_TNUMBER && type != LUA_TBOOLEAN) return describe(L, index);
  std::string text = luaL_tolstring(L, index, nullptr);
  lua_pop(L, 1);
  return text;
}

}  // namespace pendula::lua
