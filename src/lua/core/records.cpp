#include "lua/core/records.hpp"

#include <memory>

#include "lua/core/call.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {
namespace {

/// Keeps a reference to the table in the registry.
struct Record {
  lua_State* L;
  int reference;
  Record(lua_State* state, int index) : L(state) {
    lua_pushvalue(L, index);
    reference = luaL_ref(L, LUA_REGISTRYINDEX);
  }
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;
  ~Record() { luaL_unref(L, LUA_REGISTRYINDEX, reference); }
};

int make_record(lua_State* L) {
  push_object(L, std::make_shared<const Record>(L, 2), lua_tostring(L, 1));
  return 1;
}

int contents(lua_State* L) {
  const std::string type = lua_tostring(L, 1);
  const auto* held = object_at(L, 2, type.c_str());
  if (!held || !*held) throw Error("expected a " + type + ", got " + describe(L, 2));
  lua_rawgeti(L, LUA_REGISTRYINDEX, std::static_pointer_cast<const Record>(*held)->reference);
  return 1;
}

}  // namespace

void open_records(lua_State* L) {
  push_stdlib_environment(L);
  lua_pushcfunction(L, guarded<make_record>);
  lua_setfield(L, -2, "record");
  lua_pushcfunction(L, guarded<contents>);
  lua_setfield(L, -2, "contents");
  lua_pop(L, 1);
}

}  // namespace pendula::lua
