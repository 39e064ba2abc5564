#include "lua/session/patterns.hpp"

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

#include "lua/core/trampoline.hpp"
#include "lua/session/pattern_matcher.hpp"

namespace pendula::lua {

namespace {

std::string_view string_argument(lua_State* L, int i) {
  std::size_t size = 0;
  const char* bytes = luaL_checklstring(L, i, &size);
  return {bytes, size};
}

/// The offset for the optional position `i`; negative positions count from the end.
std::size_t first_offset(lua_State* L, int i, std::size_t size) {
  const lua_Integer position = luaL_optinteger(L, i, 1);
  if (position > 0) return static_cast<std::size_t>(position) - 1;
  if (position == 0 || position < -static_cast<lua_Integer>(size)) return 0;
  return size - static_cast<std::size_t>(-position);
}

bool is_plain(std::string_view pattern) {
  return pattern.find_first_of("^$*+?.([%-") == std::string_view::npos;
}

int find_plainly(lua_State* L, std::string_view source, std::string_view pattern, std::size_t from) {
  const std::size_t at = source.find(pattern, from);
  if (at == std::string_view::npos) {
    luaL_pushfail(L);
    return 1;
  }
  lua_pushinteger(L, static_cast<lua_Integer>(at) + 1);
  lua_pushinteger(L, static_cast<lua_Integer>(at + pattern.size()));
  return 2;
}

int search(lua_State* L, bool find) {
  const std::string_view source = string_argument(L, 1);
  std::string_view pattern = string_argument(L, 2);
  const std::size_t from = first_offset(L, 3, source.size());
  if (from > source.size()) {
    luaL_pushfail(L);
    return 1;
  }
  if (find && (lua_toboolean(L, 4) || is_plain(pattern))) return find_plainly(L, source, pattern, from);
  const bool anchored = pattern.starts_with('^');
  if (anchored) pattern.remove_prefix(1);
  PatternMatcher matcher(L, source, pattern);
  for (std::size_t at = from; at <= source.size(); ++at) {
    const char* const s = source.data() + at;
    if (const char* const e = matcher.match(s)) {
      if (!find) return matcher.push_captures(s, e);
      lua_pushinteger(L, static_cast<lua_Integer>(at) + 1);
      lua_pushinteger(L, e - source.data());
      return matcher.push_captures(nullptr, nullptr) + 2;
    }
    if (anchored) break;
  }
  luaL_pushfail(L);
  return 1;
}

int find(lua_State* L) { return search(L, true); }
int match(lua_State* L) { return search(L, false); }

/// The iterator of gmatch. Upvalues: text, pattern, position to continue from, end of the last
/// match (-1: none).
int next_match(lua_State* L) {
  const std::string_view source = string_argument(L, lua_upvalueindex(1));
  const std::string_view pattern = string_argument(L, lua_upvalueindex(2));
  const lua_Integer last = lua_tointeger(L, lua_upvalueindex(4));
  PatternMatcher matcher(L, source, pattern);
  for (auto at = static_cast<std::size_t>(lua_tointeger(L, lua_upvalueindex(3))); at <= source.size(); ++at) {
    const char* const s = source.data() + at;
    const char* const e = matcher.match(s);
    if (!e || e - source.data() == last) continue;
    for (int i : {3, 4}) {
      lua_pushinteger(L, e - source.data());
      lua_replace(L, lua_upvalueindex(i));
    }
    return matcher.push_captures(s, e);
  }
  return 0;
}

int gmatch(lua_State* L) {
  const std::size_t size = string_argument(L, 1).size();
  string_argument(L, 2);
  const std::size_t from = std::min(first_offset(L, 3, size), size + 1);
  lua_settop(L, 2);
  lua_pushinteger(L, static_cast<lua_Integer>(from));
  lua_pushinteger(L, -1);
  lua_pushcclosure(L, guarded<next_match>, 4);
  return 1;
}

/// Appends the replacement string with %0 … %9 substituted.
void append_filled(lua_State* L, std::string& out, const PatternMatcher& matcher, const char* s,
                   const char* e) {
  std::string_view news = string_argument(L, 3);
  for (std::size_t at = news.find('%'); at != std::string_view::npos; at = news.find('%')) {
    out += news.substr(0, at);
    const char c = at + 1 < news.size() ? news[at + 1] : '\0';
    if (c == '%') {
      out += c;
    } else if (c == '0') {
      out.append(s, e);
    } else if (std::isdigit(static_cast<unsigned char>(c))) {
      matcher.push_capture(c - '1', s, e);
      std::size_t size = 0;
      const char* bytes = luaL_tolstring(L, -1, &size);
      out.append(bytes, size);
      lua_pop(L, 2);
    } else {
      luaL_error(L, "invalid use of '%%' in replacement string");
    }
    news.remove_prefix(at + 2);
  }
  out += news;
}

/// Appends the replacement of a match; false if the match is kept.
bool append_value(lua_State* L, std::string& out, const PatternMatcher& matcher, const char* s,
                  const char* e) {
  switch (lua_type(L, 3)) {
    case LUA_TFUNCTION: {
      lua_pushvalue(L, 3);
      const int count = matcher.push_captures(s, e);
      lua_call(L, count, 1);
      break;
    }
    case LUA_TTABLE:
      matcher.push_capture(0, s, e);
      lua_gettable(L, 3);
      break;
    default:
      append_filled(L, out, matcher, s, e);
      return true;
  }
  const bool keeps = !lua_toboolean(L, -1);
  if (!keeps && !lua_isstring(L, -1)) luaL_error(L, "invalid replacement value (a %s)", luaL_typename(L, -1));
  std::size_t size = 0;
  const char* bytes = keeps ? s : lua_tolstring(L, -1, &size);
  out.append(bytes, keeps ? static_cast<std::size_t>(e - s) : size);
  lua_pop(L, 1);
  return !keeps;
}

int gsub(lua_State* L) {
  const std::string_view source = string_argument(L, 1);
  std::string_view pattern = string_argument(L, 2);
  const int type = lua_type(L, 3);
  if (type != LUA_TNUMBER && type != LUA_TSTRING && type != LUA_TFUNCTION && type != LUA_TTABLE)
    luaL_typeerror(L, 3, "string/function/table");
  const lua_Integer most = luaL_optinteger(L, 4, static_cast<lua_Integer>(source.size()) + 1);
  const bool anchored = pattern.starts_with('^');
  if (anchored) pattern.remove_prefix(1);
  PatternMatcher matcher(L, source, pattern);
  std::string out;
  lua_Integer count = 0;
  bool changed = false;
  const char *s = source.data(), *const end = s + source.size(), *last = nullptr;
  while (count < most) {
    const char* const e = matcher.match(s);
    if (e && e != last) {
      ++count;
      changed = append_value(L, out, matcher, s, e) || changed;
      s = last = e;
    } else if (s < end) {
      out += *s++;
    } else {
      break;
    }
    if (anchored) break;
  }
  out.append(s, end);
  if (changed)
    lua_pushlstring(L, out.data(), out.size());
  else
    lua_pushvalue(L, 1);
  lua_pushinteger(L, count);
  return 2;
}

}  // namespace

void open_patterns(lua_State* L) {
  lua_getglobal(L, "string");
  const std::pair<const char*, lua_CFunction> functions[] = {{"find", guarded<find>},
                                                             {"match", guarded<match>},
                                                             {"gmatch", guarded<gmatch>},
                                                             {"gsub", guarded<gsub>}};
  for (const auto& [name, function] : functions) {
    lua_pushcfunction(L, function);
    lua_setfield(L, -2, name);
  }
  lua_pop(L, 1);
}

}  // namespace pendula::lua
