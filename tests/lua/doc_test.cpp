// Every example in the documentation is run, and help answers for everything that is documented.
#include <doctest/doctest.h>

#include <algorithm>

#include "lua/core/documentation.hpp"
#include "lua/core/library.hpp"
#include "widgets.hpp"

namespace pendula::doc_test {

TEST_CASE("documentation: every row has signature, text and a true example") {
  lua_State* L = lua::new_state();
  for (const std::string& complaint : lua::check_documentation(L)) FAIL_CHECK(complaint);
  lua_close(L);
}

TEST_CASE("documentation: help answers for every documented name") {
  lua_State* L = lua::new_state();
  lua::push_stdlib_environment(L);  // where print can be silenced
  luaL_loadstring(L, R"(
    print = function() end
    local missing = {}
    for name in pairs(pendula) do
      if not pcall(help, name) then missing[#missing + 1] = name end
    end
    return table.concat(missing, " "))");
  lua_insert(L, -2);
  lua_setupvalue(L, -2, 1);
  lua::run(L, 0, 1);
  CHECK(std::string(lua_tostring(L, -1)) == "");
  lua_close(L);
}

TEST_CASE("documentation: examples that lie, fail or are missing are found") {
  static const lua::Module liars = {"liars",
                                    "Liars",
                                    {{"one", nullptr, "one()", "One.", "1 + 1", "3"},
                                     {"two", nullptr, "two()", "Two.", "nothing_here", ""},
                                     {"three", nullptr, "three()", "Three.", "", ""},
                                     {"four", nullptr, "", "Four.", "1", "1"},
                                     {"five.six", nullptr, "five.six()", "Six"},
                                     {"six#seven", nullptr, "s.seven", "Seven."}}};
  lua::Session session;
  lua::add_module(session.L, liars);
  const std::vector<std::string> complaints = lua::check_documentation(session.L);
  const auto found = [&](const char* text) {
    return std::count(complaints.begin(), complaints.end(), text) == 1;
  };
  CHECK(found("one: the example prints\n2\nbut the documentation says\n3"));
  CHECK(found("two: the example fails: example:1: undefined variable 'nothing_here'."));
  CHECK(found("three: a function needs an example"));
  CHECK(found("six#seven: the type needs a specimen (stdlib/help/specimens.lua)"));
  CHECK(found("four: signature and text must not be empty"));
  CHECK(found("five.six: the text must end with a full stop"));
}

TEST_CASE("help: unknown names and wrong arguments") {
  lua::Session session;
  CHECK(session("help 'apropso'") ==
        "user.lua:1: help: there is nothing called 'apropso'. Did you mean 'apropos'? (search: apropos "
        "\"apropso\")");
  CHECK(session("help(nil)") ==
        "user.lua:1: help: got nil; write help \"name\" with quotes, or help() for the overview");
  CHECK(session("apropos(3)") == "user.lua:1: apropos: expected a word, as in apropos \"index\"");
  CHECK(session("examples {}") == "user.lua:1: examples: expected a name, as in examples \"help\"");
}

}  // namespace pendula::doc_test
