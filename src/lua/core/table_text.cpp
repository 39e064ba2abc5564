#include "lua/core/table_text.hpp"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "base/lua_name.hpp"
#include "base/text.hpp"

namespace pendula::lua {
namespace {

constexpr int widest = 20;  // number of entries shown
constexpr int deepest = 3;  // depth of nested tables shown

/// Does the value define its own text?
bool has_text(lua_State* L, int index) {
  for (const char* field : {"__tostring", "__name"}) {
    if (luaL_getmetafield(L, index, field) == LUA_TNIL) continue;
    lua_pop(L, 1);
    return true;
  }
  return false;
}

/// tostring() without addresses, which differ from run to run.
std::string plain_text(lua_State* L, int index) {
  const int type = lua_type(L, index);
  if ((type == LUA_TFUNCTION || type == LUA_TTHREAD) && !has_text(L, index))
    return type == LUA_TFUNCTION ? "function" : "coroutine";
  if (type == LUA_TNUMBER && lua_tonumber(L, index) != lua_tonumber(L, index))
    return "nan";  // C prints "-nan" at times
  std::size_t length = 0;
  const char* text = luaL_tolstring(L, index, &length);
  std::string result(text, length);
  lua_pop(L, 1);
  return result.starts_with("file (0x") ? "file" : result;
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
  if (lua_istable(L, index) && !has_text(L, index)) return "{…}";
  const std::string text = plain_text(L, index);
  return lua_type(L, index) == LUA_TSTRING ? quoted(text) : text;
}

/// "name", or ["any text"], or [expression].
std::string key_text(lua_State* L, int index) {
  if (lua_type(L, index) != LUA_TSTRING) return "[" + item_text(L, index, deepest) + "]";
  const std::string name = lua_tostring(L, index);
  return is_lua_name(name) ? name : "[" + quoted(name) + "]";
}

/// `key = value` for all keys outside 1..length, sorted by text for reproducible output.
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

  // a list of tables is printed like the rows of a matrix
  const bool rows = depth == 0 && items.size() > 1 &&
                    std::all_of(items.begin(), items.end(), [](const auto& s) { return s.front() == '{'; });
  const std::string separator = rows ? ",\n " : ", ";
  std::string text = "{";
  for (const auto& item : items) text += (text.size() > 1 ? separator : "") + item;
  return text + "}";
}

// ── lists of records ──

lua_Integer count_of_keys(lua_State* L, int table) {
  lua_Integer count = 0;
  lua_pushnil(L);
  for (; lua_next(L, table); ++count) lua_pop(L, 1);
  return count;
}

constexpr std::size_t longest_cell = 40;

/// The text of a cell; expressions that are too long are cut.
std::string cell_text(lua_State* L, int index) {
  const bool real = lua_type(L, index) == LUA_TNUMBER && !lua_isinteger(L, index);
  std::string out = real ? rounded(lua_tonumber(L, index), 8) : plain_text(L, index);
  if (lua_type(L, index) != LUA_TUSERDATA || out.size() <= longest_cell) return out;
  std::size_t end = longest_cell - 3;
  // not inside a UTF-8 character
  while (end > 0 && (static_cast<unsigned char>(out[end]) & 0xC0) == 0x80) --end;
  return out.substr(0, end) + "…";
}

using Cells = std::vector<std::pair<std::string, std::string>>;  // key and text, by key

/// The cells of a record: { t = 1, values = { x = 2 } } has t and values.x. False if the table on top is no
/// record of short values.
bool read_record(lua_State* L, const std::string& prefix, Cells& cells) {
  luaL_checkstack(L, 8, nullptr);
  if (!is_plain_table(L, -1) || lua_rawlen(L, -1) > 0) return false;
  const int table = lua_gettop(L);
  bool good = true;
  lua_pushnil(L);
  while (good && lua_next(L, table)) {
    good = lua_type(L, -2) == LUA_TSTRING;
    if (good && is_plain_table(L, -1)) {
      good = prefix.empty() && read_record(L, std::string(lua_tostring(L, -2)) + ".", cells);
    } else if (good) {
      cells.emplace_back(prefix + lua_tostring(L, -2), cell_text(L, lua_gettop(L)));
      good =
          cells.back().second.size() <= longest_cell && cells.back().second.find('\n') == std::string::npos;
    }
    lua_pop(L, 1);
  }
  lua_settop(L, table);
  std::sort(cells.begin(), cells.end());
  return good && !cells.empty();
}

/// All keys of the rows in order; empty if a row has less than two thirds of them, so that the records
/// are not alike.
std::vector<std::string> columns_of(const std::vector<Cells>& rows) {
  std::set<std::string> keys;
  for (const Cells& row : rows)
    for (const auto& [key, value] : row) keys.insert(key);
  for (const Cells& row : rows)
    if (3 * row.size() < 2 * keys.size()) return {};
  return {keys.begin(), keys.end()};
}

/// A list of similar records as a table with the keys as head; "" for any other table.
std::string record_table(lua_State* L, int index) {
  constexpr lua_Integer most = 1000;
  const int list = lua_absindex(L, index);
  const auto n = static_cast<lua_Integer>(lua_rawlen(L, list));
  if (n < 1 || n > most || count_of_keys(L, list) != n) return "";
  std::vector<Cells> rows;
  for (lua_Integer i = 1; i <= n; ++i) {
    lua_rawgeti(L, list, i);
    rows.emplace_back();
    const bool good = read_record(L, "", rows.back());
    lua_pop(L, 1);
    if (!good) return "";
  }
  const std::vector<std::string> columns = columns_of(rows);
  if (columns.empty()) return "";
  Table table;
  table.row(columns);
  for (const Cells& row : rows) {
    std::vector<std::string> cells;
    for (const std::string& key : columns) {
      const auto at =
          std::find_if(row.begin(), row.end(), [&](const auto& cell) { return cell.first == key; });
      cells.push_back(at == row.end() ? "" : at->second);
    }
    table.row(cells);
  }
  return without_newline(table.str());
}

}  // namespace

std::string without_newline(const std::string& lines) {
  return lines.substr(0, lines.find_last_not_of('\n') + 1);
}

void make_printing_list(lua_State* L, const char* kind, lua_CFunction to_text) {
  if (luaL_newmetatable(L, kind)) {
    lua_pushcfunction(L, to_text);
    lua_setfield(L, -2, "__tostring");
    lua_pushliteral(L, "list");
    lua_setfield(L, -2, "__name");
  }
  lua_setmetatable(L, -2);
}

std::string shown_text(lua_State* L, int index) {
  if (!is_plain_table(L, index)) return plain_text(L, index);
  const std::string records = record_table(L, index);
  return records.empty() ? table_text(L, index, 0) : records;
}

}  // namespace pendula::lua
