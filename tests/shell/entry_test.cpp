// What the prompt makes of typed text, without a terminal.
#include <doctest/doctest.h>

#include <memory>

#include "lua/document/tokens.hpp"
#include "lua/session/state.hpp"
#include "shell/entry.hpp"
#include "shell/hints.hpp"

namespace pendula::entry_test {

using namespace pendula::shell;
using namespace pendula::lua;

namespace {

struct State {
  std::unique_ptr<lua_State, decltype(&lua_close)> owner{pendula::lua::new_state(), lua_close};
  lua_State* L = owner.get();

  /// How the entry is read, and the error text if it is wrong.
  std::pair<Reading, std::string> read(const std::string& entry) {
    lua_settop(L, 0);
    const Reading reading = compile(L, entry);
    return {reading, reading == Reading::wrong ? lua_tostring(L, -1) : ""};
  }

  /// The value of the entry as text.
  std::string value(const std::string& entry) {
    REQUIRE(read(entry).first == Reading::complete);
    REQUIRE(pendula::lua::run(L, 0, 1));
    return luaL_tolstring(L, -1, nullptr);
  }
};

std::string texts(std::string_view source) {
  std::string result;
  for (const Token& token : tokenize(source)) result += (result.empty() ? "" : " ") + std::string(token.text);
  return result;
}

}  // namespace

TEST_CASE("tokens: strings and comments hide what they contain") {
  CHECK(texts("x=1--local y\ny") == "x = 1 y");
  CHECK(texts("a..'--'..b") == "a .. '--' .. b");
  CHECK(texts("--[==[ ]] ]==] z") == "z");
  CHECK(texts("[=[ ]] ]=]..q[1]") == "[=[ ]] ]=] .. q [ 1 ]");
  CHECK(texts(R"("a\"b" 'c\\' d)") == R"("a\"b" 'c\\' d)");
  CHECK(texts("3e-2+0x1p+4-.5..1") == "3e-2 + 0x1p+4 - .5..1");
  CHECK(texts("a~=b//c::d...") == "a ~= b // c :: d ...");
  CHECK(tokenize("x 'abc").back().kind == TokenKind::unfinished_string);
  CHECK(tokenize("'a\\").back().kind == TokenKind::unfinished_string);
  CHECK(tokenize("x [[abc").back().kind == TokenKind::unfinished_long);
  CHECK(tokenize("x -- abc").back().kind == TokenKind::unfinished_comment);
  CHECK(tokenize("").empty());
}

TEST_CASE("globalize: top-level locals survive, everything else stays") {
  CHECK(globalize("local x = 1") == "      x = 1");
  CHECK(globalize("local x") == "      x = nil;");
  CHECK(globalize("local a <const>, b = 1, 2") == "      a        , b = 1, 2");
  CHECK(globalize("local f <close> = g()") == "local f <close> = g()");
  CHECK(globalize("local function f() local y = 1 return y end") ==
        "      function f() local y = 1 return y end");
  for (const char* kept :
       {"do local x = 1 end", "for i = 1, 3 do local x = i end", "while a do local x end",
        "repeat local x until x", "if a then local x elseif b then local y else local z end",
        "f(function() local x = 1 end)", "s = 'local x = 1'", "-- local x = 1", "s = [[\nlocal x = 1]]",
        "x.locals = 1"})
    CHECK(globalize(kept) == kept);
  CHECK(globalize("if a then b() end local x = 1") == "if a then b() end       x = 1");
  CHECK(globalize("local x\nlocal y\n(f)()") == "      x = nil;\n      y = nil;\n(f)()");
}

TEST_CASE("compile: expression, statement, or both") {
  State state;
  CHECK(state.value("1 + 1") == "2");
  CHECK(state.value("= 1 + 1") == "2");
  CHECK(state.value("1 + 1 -- sum") == "2");
  CHECK(state.value("local x <const> = 21; x * 2") == "42");
  CHECK(state.value("x") == "21");
  CHECK(state.value("local s = 'a;b'; s") == "a;b");
  CHECK(state.value("return 7") == "7");
  CHECK(state.value("(function()\n local x = 3\n return x\nend)()") == "3");
}

TEST_CASE("compile: what needs more lines, and what does not") {
  State state;
  for (const char* entry :
       {"for i = 1, 3 do", "f(", "1 +", "x =", "local function f()", "s = [[abc", "--[[ abc", "{1, 2,", "x.",
        "if a then b() else", "= 1 +", "x = 1; f(", "s = 'abc\\"}) {
    CAPTURE(std::string(entry));
    CHECK(state.read(entry).first == Reading::incomplete);
  }
  for (const char* entry :
       {"x y", "1 + * 2", "f)", "'abc", "= x = 1", "break", "goto nowhere", "x = 1; y z"}) {
    CAPTURE(std::string(entry));
    CHECK(state.read(entry).first == Reading::wrong);
  }
}

TEST_CASE("compile: the error is about what was meant") {
  State state;
  const auto error = [&](const char* entry) { return state.read(entry).second; };
  CHECK(error("1 + * 2") == "stdin:1: unexpected symbol near '*'");
  CHECK(error("x y") == "stdin:1: end of line expected near 'y'");
  CHECK(error("x = * 2") == "stdin:1: unexpected symbol near '*'");
  CHECK(error("if x = 1 then end").find("a comparison with ==") != std::string::npos);
  CHECK(error("x^2 + y^2 = 1").find("lhs ~ rhs") != std::string::npos);
  CHECK(error("x != 2").find("~=") != std::string::npos);
  CHECK(error("x += 2").find("x = x + …") != std::string::npos);
  CHECK(error("a − b").find("U+2212") != std::string::npos);
  CHECK(error("s = 'x != 2' y").find("not equal") == std::string::npos);
  CHECK(error("a = { 1, 2 x, y }").find("entries of a list are separated by commas") != std::string::npos);
  CHECK(error("a = {\n  der(x) ~ v\n  der(v) ~ -x,\n}").find("separated by commas") != std::string::npos);
  CHECK(error("print(a b)").find("arguments are separated by commas") != std::string::npos);
  CHECK(error("a = { 1, 2\nlocal b = 3").find("} closes it") != std::string::npos);
  CHECK(error("do a = { 1, 2\nreturn end").find("commas") == std::string::npos);
}

TEST_CASE("hints look at the line of the error") {
  CHECK(syntax_hint("s = '!='\nif x ! y then", "a.lua:2: 'then' expected near '!'") ==
        "\n  Lua: logical not is written not.");
  CHECK(syntax_hint("x ! y\nz", "a.lua:2: syntax error near <eof>").empty());
}

TEST_CASE("pieces: expressions among pasted statements") {
  State state;
  using List = std::vector<std::string>;
  CHECK(pieces(state.L, "x = 1\nx\n-- note\ny = 2") == List{"x = 1", "\nx", "\n\n\ny = 2"});
  CHECK(pieces(state.L, "for i = 1, 2 do\n  print(i)\nend\n1 + 1") ==
        List{"for i = 1, 2 do\n  print(i)\nend", "\n\n\n1 + 1"});
  CHECK(pieces(state.L, "x = f\n  .a\n\ny") == List{"x = f\n  .a", "\n\n\ny"});
  CHECK(pieces(state.L, "x\nfor i = 1, 2 do") == List{"x", "\nfor i = 1, 2 do"});
}

TEST_CASE("a copied session loses its prompts and its output") {
  CHECK(without_prompts("> x = 1\n> x\n1\n> for i = 1, 2 do\n… print(i)\n… end\n1\n2") ==
        "x = 1\nx\nfor i = 1, 2 do\nprint(i)\nend");
  CHECK(without_prompts("x = 1\r\ny = 2\r\n\n") == "x = 1\ny = 2");
  CHECK(without_prompts("  x") == "  x");
  CHECK(without_prompts("") == "");
  CHECK(without_prompts("> ") == ">");
}

TEST_CASE("help by question mark") {
  CHECK(help_path("reduce?") == "reduce");
  CHECK(help_path(" ?rk.gauss ") == "rk.gauss");
  CHECK(help_path("sys:reduce ?") == "sys:reduce");
  CHECK(help_path("help reduce") == "reduce");
  for (const char* other : {"help \"reduce\"", "help(x)", "x", "1?", "a b?", "?", "end?", "a.?", "help"})
    CHECK(help_path(other).empty());
}

}  // namespace pendula::entry_test
