#include "shell/completion/complete.hpp"

#include <set>

#include "base/lua_name.hpp"
#include "lua/bind/modules.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/document/tokens.hpp"
#include "lua/session/state.hpp"
#include "shell/completion/call_context.hpp"

namespace pendula::shell {
namespace {

using lua::tokenize;

/// `rk.gauss`, `q[1].do`, `sys:red`: the keys that lead to the value, and the word after the last separator.
struct Request {
  std::vector<Key> path;  ///< empty: a global name or a keyword
  char separator = '\0';  ///< '.' or ':' before the word
  std::string word;
  std::set<std::string> found;
};

bool begins_with(std::string_view text, std::string_view begin) {
  return text.substr(0, begin.size()) == begin;
}

/// Names that begin with an underscore are private: offered only if the word begins with one.
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
    // lua_tolstring converts keys that are numbers in place, which confuses lua_next.
    if (lua_type(L, -2) == LUA_TSTRING && (request.separator != ':' || is_callable(L, -1)))
      if (const char* key = lua_tostring(L, -2); is_lua_name(key)) offer(request, key);
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

/// Methods after a colon, fields after a dot, and after both the members that the stdlib adds without a
/// row in C++.
void offer_object(lua_State* L, const std::string& type, Request& request) {
  const char other = request.separator == ':' ? '#' : ':';
  for (const auto& member : lua::member_names(L, type.c_str()))
    if (!has_row(type, other, member)) offer(request, member);
}

/// The members of the value on top of the stack, including those of the __index tables of its metatables.
void offer_members(lua_State* L, Request& request) {
  constexpr int deepest = 10;  // a chain of __index tables may be a cycle
  if (const std::string type = lua::object_type(L, -1); !type.empty()) return offer_object(L, type, request);
  for (int depth = 0; depth < deepest; ++depth) {
    if (lua_istable(L, -1)) offer_keys(L, -1, request);
    if (luaL_getmetafield(L, -1, "__lazy") != LUA_TNIL) {  // entries of a library that are not loaded yet
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
    lua_pushinteger(L, std::get<long long>(key));
  }
}

/// Replaces the stack by the value at the path. Globals are read raw because reading an undefined one is an
/// error in Pendula.
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

/// Bounds the time of a field that is computed in Lua, for Ctrl-C cannot stop a completion.
void give_up(lua_State* L, lua_Debug*) { luaL_error(L, "too long for a completion"); }

void run_limited(lua_State* L, lua_CFunction function, void* request) {
  const auto hook = lua_gethook(L);
  const int mask = lua_gethookmask(L), count = lua_gethookcount(L);
  lua_sethook(L, give_up, LUA_MASKCOUNT, 200000);
  lua_pushcfunction(L, function);
  lua_pushlightuserdata(L, request);
  if (lua_pcall(L, 1, 0, 0) != LUA_OK) lua_pop(L, 1);
  lua_sethook(L, hook, mask, count);
}

/// Fills path and separator from the tokens before tokens[end]. False if the separator does not follow a
/// path, as in `f(x).`.
bool read_path(const std::vector<Token>& tokens, std::size_t end, Request& request) {
  if (end == 0 || !(tokens[end - 1].is(".") || tokens[end - 1].is(":"))) return true;
  request.separator = tokens[end - 1].text[0];
  return path_before(tokens, end - 1, request.path) != end - 1;
}

// ── options and other words inside a call ─────────────────────────────────────────────────────────────────

void set_string(lua_State* L, const char* key, const std::string& value) {
  lua_pushlstring(L, value.data(), value.size());
  lua_setfield(L, -2, key);
}

/// "rk.gauss" for a path of names; "" if the path contains an index.
std::string dotted(const std::vector<Key>& path) {
  std::string name;
  for (const Key& key : path) {
    const auto* word = std::get_if<std::string>(&key);
    if (!word) return "";
    name += (name.empty() ? "" : ".") + *word;
  }
  return name;
}

/// Pushes the value at a path that begins with a global; nil if there is none.
void push_value(lua_State* L, const std::vector<Key>& path) {
  if (path.empty()) return lua_pushnil(L);
  lua_pushglobaltable(L);
  push_key(L, path[0]);
  lua_rawget(L, -2);
  lua_remove(L, -2);
  for (std::size_t i = 1; i < path.size() && !lua_isnil(L, -1); ++i) {
    push_key(L, path[i]);
    lua_gettable(L, -2);
    lua_remove(L, -2);
  }
}

struct CallRequest {
  const CallContext& context;
  const std::string& word;
  bool in_string;
  std::vector<std::string> found;
};

/// Calls stdlib/complete.lua, which contains the tables of options.
int collect_in_call(lua_State* L) {
  auto& request = *static_cast<CallRequest*>(lua_touserdata(L, 1));
  const CallContext& context = request.context;
  lua::include_embedded(L, "complete");
  lua_newtable(L);
  set_string(L, "method", context.method);
  set_string(L, "name", dotted(context.function));
  set_string(L, "key", context.key);
  set_string(L, "word", request.word);
  lua_pushinteger(L, static_cast<lua_Integer>(context.argument));
  lua_setfield(L, -2, "argument");
  for (const auto& [key, value] : {std::pair{"in_table", context.in_table},
                                   {"at_key", context.at_key},
                                   {"in_string", request.in_string}}) {
    lua_pushboolean(L, value);
    lua_setfield(L, -2, key);
  }
  lua_newtable(L);
  for (std::size_t i = 0; i < context.tables.size(); ++i) {
    lua_pushlstring(L, context.tables[i].data(), context.tables[i].size());
    lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
  }
  lua_setfield(L, -2, "tables");
  push_value(L, context.method.empty() ? context.first : context.function);
  lua_setfield(L, -2, "object");
  lua_call(L, 1, 1);
  for (lua_Integer i = 1; lua_rawgeti(L, -1, i) == LUA_TSTRING; ++i) {
    request.found.emplace_back(lua_tostring(L, -1));
    lua_pop(L, 1);
  }
  return 0;
}

/// The words allowed at the cursor by the call around it; empty if there is no restriction.
std::vector<std::string> words_in_call(lua_State* L, const CallContext& context, const std::string& word,
                                       bool in_string) {
  if (context.argument == 0) return {};
  CallRequest request{context, word, in_string, {}};
  run_limited(L, collect_in_call, &request);
  return request.found;
}

/// For `f "word`, the call with the string as its argument; else the call around the string.
CallContext context_of_string(const std::vector<Token>& tokens, std::size_t string) {
  std::vector<Token> with_bracket(tokens.begin(), tokens.begin() + static_cast<std::ptrdiff_t>(string));
  const bool bare = string > 0 && tokens[string - 1].kind == TokenKind::name;
  if (bare) with_bracket.push_back({TokenKind::symbol, "(", tokens[string].begin});
  return call_context(with_bracket, with_bracket.size());
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
      result.quote = last.text[0];
      result.words =
          words_in_call(L, context_of_string(tokens, end - 1), std::string(last.text.substr(1)), true);
      result.files = result.words.empty();
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
  if (request.path.empty()) {
    result.words = words_in_call(L, call_context(tokens, end), request.word, false);
    if (!result.words.empty()) return result;
  }
  result.globals = request.path.empty();
  if (result.globals)
    for (const auto& word : lua_keywords()) offer(request, word);
  run_limited(L, collect, &request);
  result.words.assign(request.found.begin(), request.found.end());
  return result;
}

}  // namespace pendula::shell
