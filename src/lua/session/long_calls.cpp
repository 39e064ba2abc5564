#include "lua/session/long_calls.hpp"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <string_view>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {

namespace {

/// up to these sizes the originals take at most some 50 ms
constexpr lua_Integer many_entries = 1 << 17;
constexpr std::size_t many_bytes = std::size_t{1} << 22;

/// Is there a whole number at `index`? 1e9 counts as one.
bool is_whole(lua_State* L, int index) {
  int whole = 0;
  lua_tointegerx(L, index, &whole);
  return lua_type(L, index) == LUA_TNUMBER && whole;
}

// ── tables ──

int less(lua_State* L) {
  poll_interrupt();
  lua_pushboolean(L, lua_compare(L, 1, 2, LUA_OPLT));
  return 1;
}

/// table.sort(list [, comp]): a comparison in Lua can be interrupted, the built-in `<` cannot.
int sort(lua_State* L) {
  if (lua_istable(L, 1) && lua_isnoneornil(L, 2) && luaL_len(L, 1) > many_entries) {
    lua_settop(L, 1);
    lua_pushcfunction(L, guarded<less>);
  }
  return call_original(L);
}

/// to[at + k] = from[first + k], k = 0 … count - 1, in the order that does not overwrite unread entries.
void copy_entries(lua_State* L, int from, int to, lua_Integer first, lua_Integer at, lua_Integer count,
                  bool backwards) {
  for (lua_Integer n = 0; n < count; ++n) {
    if (n % 1024 == 0) poll_interrupt();
    const lua_Integer k = backwards ? count - 1 - n : n;
    lua_geti(L, from, first + k);
    lua_seti(L, to, at + k);
  }
}

/// table.move(a1, f, e, t [, a2])
int move(lua_State* L) {
  const bool large = is_whole(L, 2) && is_whole(L, 3) && is_whole(L, 4) && lua_tointeger(L, 2) > 0 &&
                     lua_tointeger(L, 3) - lua_tointeger(L, 2) > many_entries;
  const int to = lua_isnoneornil(L, 5) ? 1 : 5;
  if (!large || !lua_istable(L, 1) || !lua_istable(L, to)) return call_original(L);
  const lua_Integer first = lua_tointeger(L, 2), last = lua_tointeger(L, 3), at = lua_tointeger(L, 4);
  luaL_argcheck(L, at <= LUA_MAXINTEGER - (last - first), 4, "destination wrap around");
  const bool overlap = at > first && at <= last && (to == 1 || lua_compare(L, 1, to, LUA_OPEQ));
  copy_entries(L, 1, to, first, at, last - first + 1, overlap);
  lua_pushvalue(L, to);
  return 1;
}

/// table.insert(list, position, value)
int insert(lua_State* L) {
  if (lua_gettop(L) != 3 || !lua_istable(L, 1) || !is_whole(L, 2)) return call_original(L);
  const lua_Integer size = luaL_len(L, 1), position = lua_tointeger(L, 2);
  if (position < 1 || position > size || size - position < many_entries) return call_original(L);
  copy_entries(L, 1, 1, position, position + 1, size - position + 1, true);
  lua_seti(L, 1, position);
  return 0;
}

/// table.remove(list, position)
int remove(lua_State* L) {
  if (lua_gettop(L) != 2 || !lua_istable(L, 1) || !is_whole(L, 2)) return call_original(L);
  const lua_Integer size = luaL_len(L, 1), position = lua_tointeger(L, 2);
  if (position < 1 || position > size || size - position < many_entries) return call_original(L);
  lua_geti(L, 1, position);
  copy_entries(L, 1, 1, position + 1, position, size - position, false);
  lua_pushnil(L);
  lua_seti(L, 1, size);
  return 1;
}

// ── strings ──

/// Fills a string of `size` bytes piece by piece: fill(to, first, count).
template <class Fill>
int push_filled(lua_State* L, std::size_t size, const Fill& fill) {
  luaL_Buffer buffer;
  char* const to = luaL_buffinitsize(L, &buffer, size);
  for (std::size_t first = 0; first < size; first += many_bytes) {
    poll_interrupt();
    fill(to + first, first, std::min(many_bytes, size - first));
  }
  luaL_pushresultsize(&buffer, size);
  return 1;
}

/// The string at index 1 if it is long, otherwise empty.
std::string_view long_string(lua_State* L) {
  std::size_t size = 0;
  const char* bytes = lua_type(L, 1) == LUA_TSTRING ? lua_tolstring(L, 1, &size) : nullptr;
  return size > many_bytes ? std::string_view(bytes, size) : std::string_view();
}

template <int (*change)(int)>
int change_case(lua_State* L) {
  const std::string_view s = long_string(L);
  if (s.empty()) return call_original(L);
  return push_filled(L, s.size(), [&](char* to, std::size_t first, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k)
      to[k] = static_cast<char>(change(static_cast<unsigned char>(s[first + k])));
  });
}

int reverse(lua_State* L) {
  const std::string_view s = long_string(L);
  if (s.empty()) return call_original(L);
  return push_filled(L, s.size(), [&](char* to, std::size_t first, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) to[k] = s[s.size() - 1 - (first + k)];
  });
}

/// string.rep(s, n [, separator])
int repeat(lua_State* L) {
  std::size_t size = 0, gap = 0;
  const bool usual = lua_type(L, 1) == LUA_TSTRING && is_whole(L, 2) &&
                     (lua_isnoneornil(L, 3) || lua_type(L, 3) == LUA_TSTRING);
  if (!usual) return call_original(L);
  const char* s = lua_tolstring(L, 1, &size);
  const char* separator = lua_isnoneornil(L, 3) ? "" : lua_tolstring(L, 3, &gap);
  const lua_Integer n = lua_tointeger(L, 2);
  const std::size_t period = size + gap;
  constexpr auto most = static_cast<std::size_t>(LUA_MAXINTEGER) / 4;
  // excessive lengths are rejected by the original
  if (n < 2 || period == 0 || static_cast<std::size_t>(n) > most / period) return call_original(L);
  const std::size_t total = static_cast<std::size_t>(n) * period - gap;
  if (total <= many_bytes) return call_original(L);
  constexpr std::size_t beyond_memory = std::size_t{1} << 33;
  if (total > beyond_memory) return luaL_error(L, "resulting string too large");
  std::string one(s, size);
  one.append(separator, gap);
  const std::size_t copies = std::max<std::size_t>(1, 4096 / period);
  std::string some;
  for (std::size_t k = 0; k < copies; ++k) some += one;
  return push_filled(L, total, [&](char* to, std::size_t first, std::size_t count) {
    for (std::size_t k = 0; k < count;) {
      const std::size_t phase = (first + k) % period, piece = std::min(count - k, some.size() - phase);
      std::memcpy(to + k, some.data() + phase, piece);
      k += piece;
    }
  });
}

// ── finalizers ──

/// Calls a finalizer (upvalue 1) in a coroutine, since Lua disables hooks while the collector calls one, and
/// an endless loop could not be stopped.
int finalize(lua_State* L) {
  lua_State* co = lua_newthread(L);
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_pushvalue(L, 1);
  lua_xmove(L, co, 2);
  int status = LUA_OK, results = 0;
  {
    const Running running(co);
    status = lua_resume(co, L, 1, &results);
  }
  if (status == LUA_OK || status == LUA_YIELD) return 0;
  lua_xmove(co, L, 1);
  return lua_error(L);
}

/// setmetatable(t, mt): a finalizer among the fields of mt is replaced by one that can be interrupted.
int set_metatable(lua_State* L) {
  if (lua_istable(L, 1) && lua_istable(L, 2)) {
    lua_pushliteral(L, "__gc");
    if (lua_rawget(L, 2) == LUA_TFUNCTION && lua_tocfunction(L, -1) != finalize) {
      lua_pushcclosure(L, finalize, 1);
      lua_pushliteral(L, "__gc");
      lua_insert(L, -2);
      lua_rawset(L, 2);
    }
  }
  if (lua_gettop(L) > 2) lua_settop(L, 2);
  return call_original(L);
}

/// Replaces table[name] of the table on top by a closure with the original as upvalue.
void replace(lua_State* L, const char* name, lua_CFunction function) {
  lua_getfield(L, -1, name);
  lua_pushcclosure(L, function, 1);
  lua_setfield(L, -2, name);
}

}  // namespace

void open_long_calls(lua_State* L) {
  lua_getglobal(L, "table");
  replace(L, "sort", guarded<sort>);
  replace(L, "move", guarded<move>);
  replace(L, "insert", guarded<insert>);
  replace(L, "remove", guarded<remove>);
  lua_getglobal(L, "string");
  replace(L, "rep", guarded<repeat>);
  replace(L, "upper", guarded<change_case<std::toupper>>);
  replace(L, "lower", guarded<change_case<std::tolower>>);
  replace(L, "reverse", guarded<reverse>);
  lua_pushglobaltable(L);
  replace(L, "setmetatable", set_metatable);
  lua_pop(L, 3);
}

}  // namespace pendula::lua
