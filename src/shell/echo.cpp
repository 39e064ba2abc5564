#include "shell/echo.hpp"

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "lua/core/library.hpp"
#include "lua/core/table_text.hpp"
#include "lua/screen/fit_text.hpp"
#include "lua/screen/pager.hpp"

namespace pendula::shell {
namespace {

std::string type_of(lua_State* L, int index) {
  if (luaL_getmetafield(L, index, "__name") == LUA_TNIL) return "";
  const std::string name = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
  lua_pop(L, 1);
  return name;
}

/// " ≈ 1.414213562" after a number such as √2, else "".
std::string approximation(lua_State* L, int index) {
  if (luaL_getmetafield(L, index, "__approximation") == LUA_TNIL) return "";
  lua_pushvalue(L, index);
  lua_call(L, 1, 1);
  const std::string text = lua_tostring(L, -1);
  lua_pop(L, 1);
  return text.empty() ? "" : " " + text;
}

/// " = (q₁, q₂)" for a column that is displayed by its name only, else "".
std::string entries_of_column(lua_State* L, int index, const std::string& text) {
  if (type_of(L, index) != "matrix" || text.find_first_of("([ \n") != text.npos) return "";
  const lua_Integer n = luaL_len(L, index);
  constexpr lua_Integer most = 12;
  std::string list;
  for (lua_Integer i = 1; i <= std::min(n, most); ++i) {
    lua_geti(L, index, i);
    list += (i > 1 ? ", " : "") + lua::shown_text(L, -1);
    lua_pop(L, 1);
  }
  return " = (" + list + (n > most ? ", …)" : ")");
}

/// The signature of a library function; else the result of shown_text.
std::string text_of(lua_State* L, int index) {
  if (!lua_isfunction(L, index)) return lua::shown_text(L, index);
  lua::push_stdlib_environment(L);
  lua_getfield(L, -1, "function_text");
  lua_pushvalue(L, index);
  lua_call(L, 1, 1);
  const std::string text = lua_isstring(L, -1) ? lua_tostring(L, -1) : lua::shown_text(L, index);
  lua_pop(L, 2);
  return text;
}

bool is_figure(lua_State* L, int index) { return type_of(L, index) == "figure"; }

/// Responses are displayed with their figure below the text.
bool is_response(lua_State* L, int index) {
  const std::string type = type_of(L, index);
  return type == "response" || type == "frequency response";
}

void remember(lua_State* L, int index) {
  lua_pushglobaltable(L);
  lua_pushliteral(L, "ans");
  lua_pushvalue(L, index);
  lua_rawset(L, -3);
  lua_pop(L, 1);
}

void show_figure(lua_State* L, int index) {
  lua_getfield(L, index, "show");
  lua_pushvalue(L, index);
  lua_call(L, 1, 0);
}

}  // namespace

int echo_values(lua_State* L) {
  const int count = lua_gettop(L);
  bool all_nil = true;
  for (int i = 1; i <= count; ++i) all_nil = all_nil && lua_isnil(L, i);
  if (all_nil) return 0;
  if (!lua_isnil(L, 1)) remember(L, 1);
  if (count == 1 && is_figure(L, 1)) {
    show_figure(L, 1);
    return 0;
  }
  std::vector<std::string> texts;
  bool fits = true, tall = false;  // a string of the user keeps its lines
  for (int i = 1; i <= count; ++i) {
    const std::string text = text_of(L, i);
    tall = tall || text.find('\n') != text.npos;
    if (lua_type(L, i) != LUA_TSTRING || text.find('\n') != text.npos) fits = false;
    texts.push_back(text + entries_of_column(L, i, text) + approximation(L, i));
  }
  const std::string line = join(texts, tall ? "\n\n" : "  ");  // matrices side by side are hard to read
  const lua::ScreenSize screen = lua::screen_size();
  lua::show_text((fits ? line : lua::fitted(line, screen.columns)) + "\n");
  if (count == 1 && is_response(L, 1)) show_figure(L, 1);
  return 0;
}

}  // namespace pendula::shell
