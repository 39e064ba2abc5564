// Every function that takes options has a row for each, and refuses what is none of them and what has the
// wrong type: options_check.lua runs the example of each row and repeats the call it makes with such options.
#include <doctest/doctest.h>

#include <string>

#include "lua/core/documentation.hpp"
#include "widgets.hpp"

namespace pendula::options_test {

TEST_CASE("options: one table per function, which its reader knows") {
  lua::Session session;
  lua_State* L = session.L;
  REQUIRE(luaL_loadfile(L, PENDULA_ROOT "/tests/lua/options_check.lua") == LUA_OK);
  lua::push_stdlib_environment(L);
  lua_setupvalue(L, -2, 1);
  lua::run(L, 0, 1);
  CHECK(std::string(lua_tostring(L, -1)) == "");
}

}  // namespace pendula::options_test
