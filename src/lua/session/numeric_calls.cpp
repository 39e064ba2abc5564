#include "lua/session/numeric_calls.hpp"

#include <cmath>
#include <cstring>
#include <string>

#include "base/error.hpp"
#include "expr/print/print.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"
#include "lua/session/long_calls.hpp"

namespace pendula::lua {

namespace {

/// Replaces the exact number at `index` by a Lua number, an integer if it is whole; false for anything else.
bool make_number(lua_State* L, int index) {
  const auto value = constant_at(L, index);
  if (!value) return false;
  lua_pushnumber(L, *value);
  lua_Integer whole = 0;
  if (lua_numbertointeger(*value, &whole) && static_cast<double>(whole) == *value) {
    lua_pop(L, 1);
    lua_pushinteger(L, whole);
  }
  lua_replace(L, index);
  return true;
}

bool is_object(lua_State* L, int index) {
  return lua_type(L, index) == LUA_TUSERDATA && !object_type(L, index).empty();
}

/// "the expression x^2", "a matrix"
std::string shown_object(lua_State* L, int index) {
  if (object_type(L, index) != TypeName<Expr>::value) return describe(L, index);
  return "the expression " + to_text(to_expr(L, index, "it"));
}

std::string remedy_for(lua_State* L, int index) {
  if (object_type(L, index) == TypeName<Matrix>::value) return "; take an entry, m[1] or m(1, 2)";
  return "; its value is evaluate(e, { x = 1 }), along a solution sol(e, t)";
}

/// Wraps math.f(…). Upvalues: the original, its name.
int numeric_function(lua_State* L) {
  for (int i = 1; i <= lua_gettop(L); ++i) {
    if (!is_object(L, i) || make_number(L, i)) continue;
    const std::string name = lua_tostring(L, lua_upvalueindex(2));
    push_named(L, name);
    const bool has_twin = !lua_isnil(L, -1);
    throw Error(text("math.", name, " takes numbers, not ", shown_object(L, i),
                     has_twin ? "; " + name + " takes expressions and matrices too" : remedy_for(L, i)));
  }
  return call_original(L);
}

/// The letters of the conversions of a format, in order; invalid ones are left to string.format.
std::string conversions(const char* format) {
  std::string letters;
  for (const char* at = std::strchr(format, '%'); at; at = std::strchr(at, '%')) {
    at += 1 + std::strspn(at + 1, "-+ #0123456789.");
    if (*at == '\0') break;
    if (*at != '%') letters += *at;
    ++at;
  }
  return letters;
}

bool is_nan(lua_State* L, int index) {
  return lua_type(L, index) == LUA_TNUMBER && std::isnan(lua_tonumber(L, index));
}

/// string.format(f, …): converts arguments of %d, %f and similar to numbers; %s shows exact values
/// as they print.
int numeric_format(lua_State* L) {
  bool objects = false;
  for (int i = 2; i <= lua_gettop(L); ++i) {
    objects = objects || lua_type(L, i) == LUA_TUSERDATA;
    if (!is_nan(L, i)) continue;
    lua_pushnumber(L, std::copysign(lua_tonumber(L, i), 1.0));
    lua_replace(L, i);
  }
  if (objects && lua_type(L, 1) == LUA_TSTRING) {
    const std::string letters = conversions(lua_tostring(L, 1));
    for (int i = 2; i <= lua_gettop(L) && i - 2 < static_cast<int>(letters.size()); ++i) {
      const char letter = letters[i - 2];
      if (letter == 's' || letter == 'q' || !is_object(L, i) || make_number(L, i)) continue;
      throw Error(text("format: %", std::string(1, letter), " takes a number, not ", shown_object(L, i),
                       remedy_for(L, i), "; %s shows it as text"));
    }
  }
  return call_original(L);
}

/// tostring(x): without the sign of nan, which depends on the processor.
int text_of_value(lua_State* L) {
  if (!is_nan(L, 1)) return call_original(L);
  lua_pushliteral(L, "nan");
  return 1;
}

/// tonumber(x [, base]).
int numeric_value(lua_State* L) {
  if (lua_gettop(L) == 1 && is_object(L, 1) && make_number(L, 1)) return 1;
  return call_original(L);
}

/// table.concat(list, …) on a copy of the list with exact numbers as they print.
int joined_texts(lua_State* L) {
  if (!lua_istable(L, 1)) return call_original(L);
  const lua_Integer n = luaL_len(L, 1);
  bool exact = false;
  for (lua_Integer i = 1; i <= n && !exact; ++i) {
    lua_geti(L, 1, i);
    exact = constant_at(L, lua_gettop(L)).has_value() && is_object(L, lua_gettop(L));
    lua_pop(L, 1);
  }
  if (!exact) return call_original(L);
  lua_createtable(L, static_cast<int>(n), 0);
  for (lua_Integer i = 1; i <= n; ++i) {
    lua_geti(L, 1, i);
    if (is_object(L, lua_gettop(L)) && constant_at(L, lua_gettop(L))) {
      luaL_tolstring(L, -1, nullptr);
      lua_remove(L, -2);
    }
    lua_seti(L, -2, i);
  }
  lua_replace(L, 1);
  return call_original(L);
}

/// Replaces table[name] of the table on top by a closure with the original and its name as upvalues.
void wrap(lua_State* L, const char* name, lua_CFunction function) {
  lua_getfield(L, -1, name);
  lua_pushstring(L, name);
  lua_pushcclosure(L, function, 2);
  lua_setfield(L, -2, name);
}

}  // namespace

void open_numeric_calls(lua_State* L) {
  lua_getglobal(L, "math");
  for (const char* name : {"abs", "ceil", "floor", "max",  "min", "fmod", "modf", "sqrt", "sin",       "cos",
                           "tan", "asin", "acos",  "atan", "exp", "log",  "deg",  "rad",  "tointeger", "ult"})
    wrap(L, name, guarded<numeric_function>);
  lua_getglobal(L, "string");
  wrap(L, "format", guarded<numeric_format>);
  lua_getglobal(L, "table");
  wrap(L, "concat", guarded<joined_texts>);
  lua_pushglobaltable(L);
  wrap(L, "tonumber", guarded<numeric_value>);
  wrap(L, "tostring", guarded<text_of_value>);
  lua_pop(L, 4);
}

}  // namespace pendula::lua
