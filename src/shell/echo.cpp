#include "shell/echo.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "shell/tokens.hpp"

namespace pendula::shell {
namespace {

constexpr int widest = 20;  // entries of a table that are shown
constexpr int deepest = 3;  // tables within tables

std::string plain_text(lua_State* L, int index) {
  std::size_t length = 0;
  const char* text = luaL_tolstring(L, index, &length);
  std::string result(text, length);
  lua_pop(L, 1);
  return result;
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (char c : text) {
    if (c == '\n') {
      result += "\\n";
    } else {
      if (c == '"' || c == '\\') result += '\\';
      result += c;
    }
  }
  return result + "\"";
}

bool is_plain_table(lua_State* L, int index) {
  if (!lua_istable(L, index)) return false;
  const bool has_metatable = lua_getmetatable(L, index);
  if (has_metatable) lua_pop(L, 1);
  return !has_metatable;
}

std::string table_text(lua_State* L, int index, int depth);

std::string item_text(lua_State* L, int index, int depth) {
  if (is_plain_table(L, index)) return depth < deepest ? table_text(L, index, depth + 1) : "{…}";
  const std::string text = plain_text(L, index);
  return lua_type(L, index) == LUA_TSTRING ? quoted(text) : text;
}

/// "name", or ["any text"], or [expression].
std::string key_text(lua_State* L, int index) {
  if (lua_type(L, index) != LUA_TSTRING) return "[" + plain_text(L, index) + "]";
  const std::string name = lua_tostring(L, index);
  return is_name(name) ? name : "[" + quoted(name) + "]";
}

/// `key = value` of everything outside 1..length, sorted by text, so that a table is always shown the same
/// way.
std::vector<std::string> named_items(lua_State* L, int table, lua_Integer length, int depth) {
  std::vector<std::string> items;
  lua_pushnil(L);
  while (lua_next(L, table)) {
    const bool listed = lua_isinteger(L, -2) && lua_tointeger(L, -2) >= 1 && lua_tointeger(L, -2) <= length;
    if (!listed) items.push_back(key_text(L, -2) + " = " + item_text(L, lua_gettop(L), depth));
    lua_pop(L, 1);
  }
  std::sort(items.begin(), items.end());
  return items;
}

std::string table_text(lua_State* L, int index, int depth) {
  luaL_checkstack(L, 8, nullptr);
  const int table = lua_absindex(L, index);
  const auto length = static_cast<lua_Integer>(lua_rawlen(L, table));
  std::vector<std::string> items;
  for (lua_Integer i = 1; i <= std::min<lua_Integer>(length, widest); ++i) {
    lua_rawgeti(L, table, i);
    items.push_back(item_text(L, lua_gettop(L), depth));
    lua_pop(L, 1);
  }
  auto named = named_items(L, table, length, depth);
  const auto left_out = static_cast<lua_Integer>(named.size()) + length - widest;
  named.resize(std::min(named.size(), static_cast<std::size_t>(widest) - items.size()));
  items.insert(items.end(), named.begin(), named.end());
  if (left_out > 0) items.push_back("… " + std::to_string(left_out) + " more");

  // A list of tables is set as the rows of a matrix.
  const bool rows = depth == 0 && items.size() > 1 &&
                    std::all_of(items.begin(), items.end(), [](const auto& s) { return s.front() == '{'; });
  const std::string separator = rows ? ",\n " : ", ";
  std::string text = "{";
  for (const auto& item : items) text += (text.size() > 1 ? separator : "") + item;
  return text + "}";
}

std::string type_of(lua_State* L, int index) {
  if (luaL_getmetafield(L, index, "__name") == LUA_TNIL) return "";
  const std::string name = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
  lua_pop(L, 1);
  return name;
}

/// " ≈ 1.414213562" behind a number such as √2, else "".
std::string approximation(lua_State* L, int index) {
  if (luaL_getmetafield(L, index, "__approximation") == LUA_TNIL) return "";
  lua_pushvalue(L, index);
  lua_call(L, 1, 1);
  const std::string text = lua_tostring(L, -1);
  lua_pop(L, 1);
  return text.empty() ? "" : " " + text;
}

bool is_figure(lua_State* L, int index) { return type_of(L, index) == "figure"; }

/// Curves that are looked at: their figure is drawn under their text.
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

std::string echo_text(lua_State* L, int index) {
  return is_plain_table(L, index) ? table_text(L, index, 0) : plain_text(L, index);
}

int echo_values(lua_State* L) {
  const int count = lua_gettop(L);
  bool all_nil = true;
  for (int i = 1; i <= count; ++i) all_nil = all_nil && lua_isnil(L, i);
  if (all_nil) return 0;
  if (!lua_isnil(L, 1)) remember(L, 1);
  if (count == 1 && is_figure(L, 1)) return show_figure(L, 1), 0;
  std::string line;
  for (int i = 1; i <= count; ++i) line += (i > 1 ? "\t" : "") + echo_text(L, i) + approximation(L, i);
  line += "\n";
  std::fwrite(line.data(), 1, line.size(), stdout);
  if (count == 1 && is_response(L, 1)) show_figure(L, 1);
  return 0;
}

}  // namespace pendula::shell
