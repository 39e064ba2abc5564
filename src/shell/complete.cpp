#include "shell/complete.hpp"

#include <set>
#include <variant>

#include "lua/bind/modules.hpp"
#include "lua/core/objects.hpp"
#include "lua/document/tokens.hpp"
#include "lua/session/state.hpp"

namespace pendula::shell {
namespace {

using lua::is_name;
using lua::keywords;
using lua::Token;
using lua::tokenize;
using lua::TokenKind;

using Key = std::variant<std::string, lua_Integer>;

/// `rk.gauss`, `q[1].do`, `sys:red`: the keys that lead to the value, and the word behind the last separator.
struct Request {
  std::vector<Key> path;  ///< empty: a global name or a keyword
  char separator = '\0';  ///< '.' or ':' in front of the word
  std::string word;
  std::set<std::string> found;
};

bool begins_with(std::string_view text, std::string_view begin) {
  return text.substr(0, begin.size()) == begin;
}

/// Names that begin with an underscore are private: offered only to who types the underscore.
void offer(Request& request, std::string_view name) {
  const bool hidden = begins_with(name, "_") && request.word.empty();
  if (begins_with(name, request.word) && !hidden) request.found.emplace(name);
}

bool is_callable(lua_State* L, int index) {
  if (lua_isfunction(L, index)) return true;
  const bool callable = luaL_getmetafield(L, index, "__call") != LUA_TNIL;
  if (callable) lua_pop(L, 1);
  return callable;
}

void offer_keys(lua_State* L, int table, Request& request) {
  table = lua_absindex(L, table);
  lua_pushnil(L);
  while (lua_next(L, table)) {
    // Keys that are numbers must not be converted in place: lua_next would lose its way.
    if (lua_type(L, -2) == LUA_TSTRING && (request.separator != ':' || is_callable(L, -1)))
      if (const char* key = lua_tostring(L, -2); is_name(key)) offer(request, key);
    lua_pop(L, 1);
  }
}

/// Is there a row "type:member" (separator ':', a method) or "type#member" ('#', a field)?
bool has_row(const std::string& type, char separator, const std::string& member) {
  const std::string name = type + separator + member;
  for (const auto* module : lua::modules())
    for (const auto& row : module->rows)
      if (name == row.name) return true;
  return false;
}

/// Methods behind a colon, fields behind a dot; members the stdlib adds without a row of C++ behind both.
void offer_object(lua_State* L, const std::string& type, Request& request) {
  const char other = request.separator == ':' ? '#' : ':';
  for (const auto& member : lua::member_names(L, type.c_str()))
    if (!has_row(type, other, member)) offer(request, member);
}

/// Everything the value on top of the stack answers to, its metatables' tables included.
void offer_members(lua_State* L, Request& request) {
  constexpr int deepest = 10;  // a chain of __index tables may be a ring
  if (const std::string type = lua::object_type(L, -1); !type.empty()) return offer_object(L, type, request);
  for (int depth = 0; depth < deepest; ++depth) {
    if (lua_istable(L, -1)) offer_keys(L, -1, request);
    if (luaL_getmetafield(L, -1, "__lazy") != LUA_TNIL) {  // entries of a library that are not made yet
      if (lua_istable(L, -1)) offer_keys(L, -1, request);
      lua_pop(L, 1);
    }
    if (luaL_getmetafield(L, -1, "__index") != LUA_TTABLE) return;
  }
}

void push_key(lua_State* L, const Key& key) {
  if (const auto* name = std::get_if<std::string>(&key)) {
    lua_pushlstring(L, name->data(), name->size());
  } else {
    lua_pushinteger(L, std::get<lua_Integer>(key));
  }
}

/// Replaces the stack by the value the path leads to. Globals are read raw: an
/// undefined one is an error in Pendula.
void walk(lua_State* L, const Request& request) {
  lua_settop(L, 0);
  lua_pushglobaltable(L);
  push_key(L, request.path[0]);
  lua_rawget(L, -2);
  for (std::size_t i = 1; i < request.path.size(); ++i) {
    push_key(L, request.path[i]);
    lua_gettable(L, -2);
  }
  lua_replace(L, 1);
  lua_settop(L, 1);
}

int collect(lua_State* L) {
  auto& request = *static_cast<Request*>(lua_touserdata(L, 1));
  if (request.path.empty()) {
    lua_pushglobaltable(L);
    offer_keys(L, -1, request);
    return 0;
  }
  walk(L, request);
  if (!lua_isnil(L, 1)) offer_members(L, request);
  return 0;
}

/// A field that is computed in Lua must not keep the user waiting, for Ctrl-C cannot stop a completion.
void give_up(lua_State* L, lua_Debug*) { luaL_error(L, "too long for a completion"); }

void run_collect(lua_State* L, Request& request) {
  const auto hook = lua_gethook(L);
  const int mask = lua_gethookmask(L), count = lua_gethookcount(L);
  lua_sethook(L, give_up, LUA_MASKCOUNT, 200000);
  lua_pushcfunction(L, collect);
  lua_pushlightuserdata(L, &request);
  if (lua_pcall(L, 1, 0, 0) != LUA_OK) lua_pop(L, 1);
  lua_sethook(L, hook, mask, count);
}

/// Reads the key that ends before tokens[end]: `name`, or `[3]` or `["x"]` with literals. Returns its first
/// token's index, or `end` if there is none.
std::size_t key_before(const std::vector<Token>& tokens, std::size_t end, std::vector<Key>& path) {
  if (end >= 1 && tokens[end - 1].kind == TokenKind::name) {
    path.insert(path.begin(), std::string(tokens[end - 1].text));
    return end - 1;
  }
  if (end < 3 || !tokens[end - 1].is("]") || !tokens[end - 3].is("[")) return end;
  const Token& literal = tokens[end - 2];
  if (literal.kind == TokenKind::string && literal.text.find('\\') == std::string_view::npos) {
    path.insert(path.begin(), std::string(literal.text.substr(1, literal.text.size() - 2)));
    return end - 3;
  }
  if (literal.kind == TokenKind::number && literal.text.size() < 10 &&
      literal.text.find_first_not_of("0123456789") == std::string_view::npos) {
    path.insert(path.begin(), static_cast<lua_Integer>(std::stoll(std::string(literal.text))));
    return end - 3;
  }
  return end;
}

/// Fills path and separator from the tokens before tokens[end]. False: nothing
/// sensible stands there, as in `f(x).`.
bool read_path(const std::vector<Token>& tokens, std::size_t end, Request& request) {
  if (end == 0 || !(tokens[end - 1].is(".") || tokens[end - 1].is(":"))) return true;
  request.separator = tokens[end - 1].text[0];
  for (std::size_t at = end - 1;;) {
    const std::size_t key = key_before(tokens, at, request.path);
    if (key == at) return false;
    const bool index = tokens[key].is("[");
    if (!index && (key == 0 || !tokens[key - 1].is("."))) return true;
    at = index ? key : key - 1;
  }
}

}  // namespace

Completions complete(lua_State* L, std::string_view text) {
  const auto tokens = tokenize(text);
  Completions result;
  result.begin = text.size();
  std::size_t end = tokens.size();
  Request request;
  if (end > 0) {
    const Token& last = tokens.back();
    if (last.kind == TokenKind::unfinished_string) {
      result.begin = last.begin + 1;
      result.file_quote = last.text[0];
      return result;
    }
    if (last.kind == TokenKind::unfinished_long || last.kind == TokenKind::unfinished_comment) return result;
    const bool touches = last.begin + last.text.size() == text.size();
    if (touches && last.kind == TokenKind::number) return result;
    if (touches && (last.kind == TokenKind::name || last.kind == TokenKind::keyword)) {
      request.word = last.text;
      result.begin = last.begin;
      --end;
    }
  }
  if (!read_path(tokens, end, request)) return result;
  if (request.path.empty())
    for (const auto& word : keywords()) offer(request, word);
  run_collect(L, request);
  result.words.assign(request.found.begin(), request.found.end());
  return result;
}

}  // namespace pendula::shell
