// Options: the table of named arguments that is the last argument of most calls.
#include "lua/core/call.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "base/text.hpp"
#include "lua/core/documentation.hpp"
#include "lua/core/foreign_names.hpp"
#include "lua/core/key_in_words.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

namespace {

/// Pushes the value of `key`, or nil if there is no table. Raw access, independent of the user's metatables.
int push_option(lua_State* L, int table, const char* key) {
  if (table == 0) {
    lua_pushnil(L);
    return LUA_TNIL;
  }
  lua_pushstring(L, key);
  return lua_rawget(L, table);
}

/// Advice for an option of another function or program.
std::string elsewhere(const std::string& key, const std::vector<std::string>& known) {
  const bool makes_model = std::find(known.begin(), known.end(), "multipliers") != known.end();
  if (key == "inputs" && makes_model)
    return " A force as a function of t belongs to integrate{ inputs = { F = sin(t) } }; one that depends on the "
           "motion closes the loop: dae{ model, F ~ -10*x - x.dot }.";
  const std::string remedy = remedy_for_option(key, known);
  return remedy.empty() ? "" : text(" Here: ", remedy, ".");
}

[[noreturn]] void refuse(std::vector<std::string> unknown, const std::vector<std::string>& known) {
  std::sort(unknown.begin(), unknown.end());
  std::string hints;
  for (const std::string& key : unknown) {
    const std::string nearest = nearest_word(key, known);
    if (nearest.empty() || !elsewhere(key, known).empty()) continue;
    hints += unknown.size() == 1 ? did_you_mean(key, known)
                                 : text(hints.empty() ? " Did you mean " : ", ", nearest, " for '", key, "'");
  }
  if (unknown.size() > 1 && !hints.empty()) hints += "?";
  for (const std::string& key : unknown) hints += elsewhere(key, known);
  const auto is_option = [&](const char* name) {
    return std::find(known.begin(), known.end(), name) != known.end();
  };
  const bool starts = is_option("start");
  for (const char* word : {"fix", "guess"})
    if (hints.empty() && starts && unknown[0] == word)
      hints = text(" That belongs to init: start = sys:init{ ", word, " = { … } }.");
  if (hints.empty() && is_option("fix") && is_option("guess"))
    hints = text(" A value at the start stands in fix = { ", unknown[0], " = 1 }.");
  if (hints.empty() && starts && is_option("to"))
    hints = text(
        " An initial value stands in start = { ", unknown[0], " = 1 }",
        is_option("params") ? text(", the value of a parameter in params = { ", unknown[0], " = 1 }") : "",
        ".");
  throw Error(text(unknown.size() == 1 ? "unknown option '" : "unknown options '", join(unknown, "', '"),
                   "'.", hints, " (options: ", join(known, ", "), ")"));
}

/// Describes a value of the wrong type on top of the stack.
std::string wrong_type(lua_State* L, const OptionRow& row) {
  const std::string_view type = row.type;
  return text("option '", row.name, "': expected ",
              type == "boolean" ? "true or false" : with_article(row.type), ", got ", describe(L, -1),
              *row.text ? text(" (", prose(row.text), ")") : "");
}

}  // namespace

OptionTable joined(const OptionTable& first, const OptionTable& more) {
  OptionTable all = first;
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

bool admits(std::string_view type, lua_State* L, int index) {
  const int given = lua_type(L, index);
  const bool object = given == LUA_TUSERDATA, table = given == LUA_TTABLE;
  for (std::string_view rest = type; !rest.empty();) {
    const std::size_t end = std::min(rest.find(" or "), rest.find(", "));
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(end == rest.npos ? rest.size() : end + (rest[end] == ',' ? 2 : 4));
    const bool good = word == "number" || word == "integer" ? object || given == LUA_TNUMBER
                      : word == "boolean"                   ? given == LUA_TBOOLEAN
                      : word == "string"                    ? given == LUA_TSTRING
                      : word == "function"                  ? object || table || given == LUA_TFUNCTION
                      : word == "expression" ? object || given == LUA_TNUMBER || given == LUA_TSTRING
                      : word == "matrix" || word == "list of numbers"
                          ? object || table || given == LUA_TNUMBER
                      : word == "list of symbols" ? object || table || given == LUA_TSTRING
                                                  : object || table;
    if (good) return true;
  }
  return false;
}

void check_options(lua_State* L, int index, const OptionTable& known) {
  std::vector<std::string> names;
  for (const OptionRow& option : known)
    if (!std::isdigit(static_cast<unsigned char>(option.name[0]))) names.emplace_back(option.name);
  std::vector<std::string> positions, unknown, wrong;  // sorted, since the order of table keys is arbitrary
  lua_pushnil(L);
  while (lua_next(L, index) != 0) {
    const std::string key = key_in_words(L, -2);
    const auto row =
        std::find_if(known.begin(), known.end(), [&](const OptionRow& option) { return option.name == key; });
    if (lua_type(L, -2) != LUA_TSTRING)
      positions.push_back(key);
    else if (row == known.end())
      unknown.push_back(key);
    else if (!admits(row->type, L, -1))
      wrong.push_back(wrong_type(L, *row));
    lua_pop(L, 1);
  }
  if (!positions.empty())
    throw Error(text("options are written { name = value }, but this table has the key [",
                     *std::min_element(positions.begin(), positions.end()),
                     "]; known options: ", join(names, ", ")));
  if (!unknown.empty()) refuse(std::move(unknown), names);
  if (!wrong.empty()) throw Error(*std::min_element(wrong.begin(), wrong.end()));
}

Options Call::options(int i) const {
  PENDULA_ASSERT(row.options != nullptr, "a row without a table of options reads options");
  return options(i, *row.options);
}

Options Call::options(int i, const OptionTable& known) const {
  if (!has(i)) return {this, 0};
  if (!lua_istable(L, i)) wrong(i, "options", "a table of options");
  check_options(L, i, known);
  return {this, i};
}

void Options::wrong(const char* key, const char* expected) const {
  lua_State* L = call_->L;
  push_option(L, index_, key);
  throw Error(text("option '", key, "': expected ", expected, ", got ", describe(L, -1)));
}

int Options::push(const char* key) const {
  push_option(call_->L, index_, key);
  return lua_gettop(call_->L);
}

bool Options::has(const char* key) const {
  const bool given = push_option(call_->L, index_, key) != LUA_TNIL;
  lua_pop(call_->L, 1);
  return given;
}

double Options::number(const char* key) const {
  const bool plain = push_option(call_->L, index_, key) == LUA_TNUMBER;
  const auto constant = plain ? std::nullopt : constant_at(call_->L, -1);  // 2*pi
  if (!plain && !constant) wrong(key, "a number");
  const double value = plain ? lua_tonumber(call_->L, -1) : *constant;
  lua_pop(call_->L, 1);
  return value;
}

double Options::number(const char* key, double fallback) const { return has(key) ? number(key) : fallback; }

long Options::integer(const char* key, long fallback) const {
  if (!has(key)) return fallback;
  if (push_option(call_->L, index_, key) != LUA_TNUMBER) wrong(key, "an integer");
  int whole = 0;
  const lua_Integer value = lua_tointegerx(call_->L, -1, &whole);
  if (!whole) {
    throw Error(text("option '", key, "': expected an integer, got ", luaL_tolstring(call_->L, -1, nullptr)));
  }
  lua_pop(call_->L, 1);
  return static_cast<long>(value);
}

bool Options::boolean(const char* key, bool fallback) const {
  const int type = push_option(call_->L, index_, key);
  if (type != LUA_TNIL && type != LUA_TBOOLEAN) wrong(key, "true or false");
  const bool value = type == LUA_TNIL ? fallback : lua_toboolean(call_->L, -1) != 0;
  lua_pop(call_->L, 1);
  return value;
}

std::string Options::string(const char* key) const {
  if (push_option(call_->L, index_, key) != LUA_TSTRING) wrong(key, "a string");
  size_t size = 0;
  const char* bytes = lua_tolstring(call_->L, -1, &size);
  std::string value(bytes, size);
  lua_pop(call_->L, 1);
  return value;
}

std::string Options::string(const char* key, const std::string& fallback) const {
  return has(key) ? string(key) : fallback;
}

}  // namespace pendula::lua
