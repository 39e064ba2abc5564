#include "lua/bind/integrate/event_list.hpp"

#include <string>

#include "base/text.hpp"
#include "lua/core/call.hpp"
#include "lua/core/table_text.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {
namespace {

/// A field of the table on top of the stack as text; "" where there is none.
std::string field_text(lua_State* L, const char* name) {
  const int top = lua_gettop(L);
  std::string shown;
  if (lua_getfield(L, -1, name) == LUA_TNUMBER)
    shown = rounded(lua_tonumber(L, -1), 8);
  else if (!lua_isnil(L, -1))
    shown = luaL_tolstring(L, -1, nullptr);
  lua_settop(L, top);
  return shown;
}

int event_list_text(lua_State* L) {
  const auto count = static_cast<lua_Integer>(lua_rawlen(L, 1));
  if (count == 0) {
    lua_pushliteral(L, "no events");
    return 1;
  }
  Table table({true, true});
  table.row({"t", "which", "action", "when"});
  for (lua_Integer i = 1; i <= count; ++i) {
    lua_rawgeti(L, 1, i);
    if (lua_istable(L, -1)) {
      const std::string when = field_text(L, "when"), part = field_text(L, "part");
      table.row({field_text(L, "t"), field_text(L, "which"), field_text(L, "action"),
                 when.empty() ? "" : when + " = 0" + (part.empty() ? "" : " of " + part)});
    }
    lua_settop(L, 1);
  }
  const std::string out = without_newline(table.str());
  lua_pushlstring(L, out.data(), out.size());
  return 1;
}

}  // namespace

void make_event_list(lua_State* L) { make_printing_list(L, "pendula.events", guarded<event_list_text>); }

}  // namespace pendula::lua
