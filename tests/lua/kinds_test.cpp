// Every kind of result: see kinds_check.lua.
#include <doctest/doctest.h>

#include <string>

#include "lua/core/documentation.hpp"
#include "widgets.hpp"

namespace pendula::kinds_test {

TEST_CASE("kinds: every result prints, has JSON, and comes back from a file") {
  lua::Session session;
  lua_State* L = session.L;
  REQUIRE(luaL_loadfile(L, PENDULA_ROOT "/tests/lua/kinds_check.lua") == LUA_OK);
  lua::push_stdlib_environment(L);
  lua_setupvalue(L, -2, 1);
  lua::run(L, 0, 1);
  CHECK(std::string(lua_tostring(L, -1)) == "");
}

}  // namespace pendula::kinds_test
