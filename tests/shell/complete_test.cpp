// Completion against a real state.
#include <doctest/doctest.h>

#include <algorithm>
#include <memory>

#include "lua/core/table_text.hpp"
#include "lua/session/state.hpp"
#include "shell/completion/complete.hpp"
#include "shell/echo.hpp"

namespace pendula::complete_test {

using namespace pendula::shell;
using Words = std::vector<std::string>;

namespace {

struct State {
  std::unique_ptr<lua_State, decltype(&lua_close)> owner{pendula::lua::new_state(), lua_close};
  lua_State* L = owner.get();

  explicit State(const char* code) {
    REQUIRE(luaL_loadstring(L, code) == LUA_OK);
    REQUIRE(pendula::lua::run(L, 0, 0));
  }

  Words words(std::string_view text) { return complete(L, text).words; }
  bool offers(std::string_view text, const std::string& word) {
    const auto all = words(text);
    return std::find(all.begin(), all.end(), word) != all.end();
  }
};

}  // namespace

TEST_CASE("complete: options of every kind of function") {
  State s("d = iddata{ y = { 1, 2 } }");
  CHECK(s.words("prbs(31, { ho") == Words{"hold"});
  CHECK(s.words("lsq(A, y, { co") == Words{"covariance"});
  CHECK(s.words("d:resample(0.5, { method = \"l") == Words{"linear", "lowpass"});
  CHECK(s.words("dae.linear{ E = E, na") == Words{"name"});
  CHECK(s.words("d:plot{ the") == Words{"theme"});
}

TEST_CASE("complete: globals and keywords") {
  State s("wagon_mass = 1 wagon_length = 2 _hidden = 3");
  CHECK(s.words("wagon_") == Words{"wagon_length", "wagon_mass"});
  CHECK(s.words("2 * wagon_m") == Words{"wagon_mass"});
  CHECK(s.words("whi") == Words{"while"});
  CHECK(s.offers("", "print"));
  CHECK_FALSE(s.offers("", "_hidden"));
  CHECK(s.offers("_h", "_hidden"));
  CHECK(s.offers("x = he", "help"));
}

TEST_CASE("complete: fields behind a dot, functions behind a colon") {
  State s(
      "car = {mass = 1, move = function() end, wheels = {{size = 1}, left = {spin = 2}}, ['not a name'] = "
      "1}");
  CHECK(s.words("car.") == Words{"mass", "move", "wheels"});
  CHECK(s.words("car.m") == Words{"mass", "move"});
  CHECK(s.words("car:m") == Words{"move"});
  CHECK(s.words("print(car.wheels[1].") == Words{"size"});
  CHECK(s.words("car['wheels'].left.") == Words{"spin"});
  CHECK(s.words("car .\nma") == Words{"mass"});
  CHECK(s.offers("string.f", "format"));
  CHECK(s.words("car.nothing.").empty());
  CHECK(s.words("nothing.x").empty());
  CHECK(s.words("f(x).").empty());
  CHECK(s.words("car.mass.").empty());
  CHECK(s.words("3.").empty());
}

TEST_CASE("complete: metatables are followed, errors and endless loops are not") {
  State s(R"(
    Base = {stop = function() end}
    Wagon = setmetatable({go = function() end}, {__index = Base})
    Base.__index = Base
    w = setmetatable({}, {__index = Wagon})
    text = "abc"
    bad = setmetatable({}, {__index = function() error "no" end})
    endless = setmetatable({}, {__index = function() while true do end end})
    ring = {}
    setmetatable(ring, {__index = ring}))");
  CHECK(s.words("w:") == Words{"go", "stop"});
  CHECK(s.words("text:fo") == Words{"format"});
  CHECK(s.words("bad.x.").empty());
  CHECK(s.words("endless.x.").empty());
  CHECK(s.words("ring.").empty());
  CHECK(lua_gettop(s.L) == 0);
  const bool hooked = lua_gethook(s.L) != nullptr;
  CHECK_FALSE(hooked);
}

TEST_CASE("complete: inside quotes file names, inside comments nothing") {
  State s("");
  CHECK(complete(s.L, "iddata.read(\"da").quote == '"');
  CHECK(complete(s.L, "x = 'da").quote == '\'');
  CHECK(complete(s.L, "x = 'da'").quote == '\0');
  CHECK(s.words("-- pri").empty());
  CHECK(s.words("x = [[pri").empty());
  CHECK(s.offers("x = 'a' .. pri", "print"));
}

TEST_CASE("echo: plain tables are written as Lua would read them") {
  State s("");
  const auto echo = [&](const std::string& expression) {
    REQUIRE(luaL_loadstring(s.L, ("return " + expression).c_str()) == LUA_OK);
    REQUIRE(pendula::lua::run(s.L, 0, 1));
    const std::string text = pendula::lua::shown_text(s.L, -1);
    lua_pop(s.L, 1);
    return text;
  };
  CHECK(echo("1.5") == "1.5");
  CHECK(echo("'abc'") == "abc");
  CHECK(echo("{1, 2.5, 'a\"b', nil}") == "{1, 2.5, \"a\\\"b\"}");
  CHECK(echo("{1, y = 2, x = {3}, ['two words'] = true, [10] = 0}") ==
        "{1, [\"two words\"] = true, [10] = 0, x = {3}, y = 2}");
  CHECK(echo("{{1, 2}, {3, 4}}") == "{{1, 2},\n {3, 4}}");
  CHECK(echo("{}") == "{}");
  CHECK(echo("(function() local t = {} for i = 1, 100 do t[i] = i end return t end)()") ==
        "{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, … 80 more}");
  CHECK(echo("(function() local t = {} t[1] = t return t end)()") == "{{{{{…}}}}}");
  CHECK(echo("setmetatable({}, {__tostring = function() return 'me' end})") == "me");
}

TEST_CASE("complete: options, their values, and symbols of the model inside a call") {
  State s(
      "x, v = vars 'x v' g = param('g', 9.81) u = input 'u' ball = dae { der(x) ~ v, der(v) ~ u - g }\n"
      "sol = ball:integrate { start = { x = 1, v = 0 }, to = 1, inputs = { u = 0 } }");
  CHECK(s.offers("ball:integrate { ", "start"));
  CHECK(s.words("ball:integrate { sta") == Words{"start"});
  CHECK(s.words("ball:integrate{ start = { x = 1 }, me") == Words{"method"});
  CHECK(s.words("s = ball:integrate { ma") == Words{"max_steps"});
  CHECK(s.words("ball:integrate { start = { ") == Words{"v", "x"});
  CHECK(s.words("ball:integrate { params = { ") == Words{"g"});
  CHECK(s.words("ball:integrate { inputs = { ") == Words{"u"});
  CHECK(s.words("ball:integrate { method = \"rad") == Words{"radau"});
  CHECK(s.words("ball:integrate { method = \"dopri") == Words{"dopri5"});
  CHECK(s.words("ball:integrate { method = \"cos").empty());  // rk.cost is no method
  CHECK(s.words("c2d(G, 0.1, \"b") == Words{"backward", "bilinear"});
  CHECK(s.offers("help \"stiffn", "stiffness"));
  CHECK(s.words("ball:integrate { direct = ") == Words{"false", "true"});
  CHECK(s.words("ball:reduce \"b") == Words{"baumgarte"});
  CHECK(s.words("ball:reduce(\"b") == Words{"baumgarte"});
  CHECK(s.words("newton { r = x^2 - 2, jacobian = \"fr") == Words{"frozen"});
  CHECK(s.words("newton { r = x^2 - 2, jacobian = frozn").empty());
  CHECK(s.words("sweep(ball, { des") == Words{"design"});
  CHECK(s.words("sweep(ball, { start = { ") == Words{"v", "x"});
  CHECK(s.offers("help \"integ", "integrate"));
  CHECK(s.offers("plot(sol, { ", "x"));
  CHECK_FALSE(s.offers("plot(sol, { ", "print"));
  // Where anything may stand, everything is offered.
  CHECK(s.offers("ball:integrate { start = pri", "print"));
  CHECK(s.offers("f(", "print"));
  CHECK(s.offers("(", "print"));
  CHECK(s.offers("t = { ", "print"));
  CHECK(s.offers("ball:integrate { start = { [", "x"));
  CHECK(s.offers("ball:integrate { to = 1 } pri", "print"));
  CHECK(s.words("print \"nothing").empty());
}

}  // namespace pendula::complete_test
