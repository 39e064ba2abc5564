#include "lua/core/objects.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <set>
#include <variant>

#include "base/error.hpp"
#include "base/remembered.hpp"
#include "base/text.hpp"
#include "expr/graph/graph.hpp"
#include "lua/core/call.hpp"
#include "lua/core/foreign_names.hpp"
#include "lua/core/key_in_words.hpp"
#include "lua/core/library.hpp"
#include "lua/core/memory.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {

namespace {

/// The addresses of these are registry keys that no script can form.
char types_key, type_key, methods_key, fields_key, fallback_key, columns_key;

/// The expressions in an object, known one by one.
struct Known {
  Touch touch;
  std::optional<std::uint16_t> window;  ///< in which they were touched last
};

struct Box {
  std::shared_ptr<const void> object;
  std::variant<Windows, Known> expressions;  ///< the windows of those that it may refer to, or these
  Box *before = nullptr, *after = nullptr;
};

/// Head of the list of nonempty boxes, of all states.
Box* first_box = nullptr;

void enter(Box& box) {
  box.after = first_box;
  if (first_box) first_box->before = &box;
  first_box = &box;
}

/// __gc: destroys the value but leaves an empty, valid Box, since a finalizer of the script may
/// resurrect the userdata.
int finalize(lua_State* L) {
  Box& box = *static_cast<Box*>(lua_touserdata(L, 1));
  if (!box.object) return 0;
  if (box.after) box.after->before = box.before;
  (box.before ? box.before->after : first_box) = box.after;
  box.expressions = Windows();
  box.object.reset();
  return 0;
}

/// Records that the running call reads an object.
void note_use(Box& box) {
  Known* known = std::get_if<Known>(&box.expressions);
  if (!known) return Origins::add(std::get<Windows>(box.expressions));
  if (known->window == expression_window()) return;  // a loop reads long vectors in every turn
  known->touch(box.object.get());
  known->window = expression_window();
}

void append_string_keys(lua_State* L, int table, std::vector<std::string>& names) {
  const int absolute = lua_absindex(L, table);
  lua_pushnil(L);
  while (lua_next(L, absolute) != 0) {
    lua_pop(L, 1);
    if (lua_type(L, -1) == LUA_TSTRING) names.emplace_back(lua_tostring(L, -1));
  }
}

/// Pushes the columns and matrices that were read from the object at 1, by the names of their fields; nil if
/// there are none and none is wanted. Both tables are weak: what nobody else holds is made anew.
void push_columns_of(lua_State* L, bool wanted) {
  const auto push_weak = [L](const char* mode) {
    lua_newtable(L);
    lua_createtable(L, 0, 1);
    lua_pushstring(L, mode);
    lua_setfield(L, -2, "__mode");
    lua_setmetatable(L, -2);
  };
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &columns_key) == LUA_TNIL) {
    lua_pop(L, 1);
    push_weak("k");
    lua_pushvalue(L, -1);
    lua_rawsetp(L, LUA_REGISTRYINDEX, &columns_key);
  }
  lua_pushvalue(L, 1);
  if (lua_rawget(L, -2) == LUA_TNIL && wanted) {
    lua_pop(L, 1);
    push_weak("v");
    lua_pushvalue(L, 1);
    lua_pushvalue(L, -2);
    lua_rawset(L, -4);
  }
  lua_remove(L, -2);
}

/// The field of the object at 1 whose name is at 2; its function is on top. Objects do not change, so that a
/// column is read once, whatever loop asks for d.y[k].
int push_field(lua_State* L) {
  push_columns_of(L, false);
  lua_pushvalue(L, 2);
  if (!lua_isnil(L, -2) && lua_rawget(L, -2) != LUA_TNIL) return 1;
  lua_pop(L, 2);
  lua_pushvalue(L, 1);
  lua_call(L, 1, 1);
  if (object_type(L, -1) != "matrix") return 1;
  push_columns_of(L, true);
  lua_pushvalue(L, 2);
  lua_pushvalue(L, -3);
  lua_rawset(L, -3);
  lua_pop(L, 1);
  return 1;
}

/// __index(object, key): a method, else a field, else the row "type:__index" of the type. Upvalues: methods,
/// fields, metatable, type name.
int index_object(lua_State* L) {
  if (lua_type(L, 2) == LUA_TSTRING) {
    lua_pushvalue(L, 2);
    if (lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) return 1;
    lua_pushvalue(L, 2);
    if (lua_rawget(L, lua_upvalueindex(2)) != LUA_TNIL) return push_field(L);
    // x:json() of any object
    if (std::strcmp(lua_tostring(L, 2), "json") == 0) {
      push_vocabulary(L, "json");
      return 1;
    }
  }
  lua_settop(L, 2);
  if (lua_rawgetp(L, lua_upvalueindex(3), &fallback_key) != LUA_TNIL) {
    lua_pushvalue(L, 1);
    lua_pushvalue(L, 2);
    lua_call(L, 2, 1);
    if (!lua_isnil(L, -1) || lua_isinteger(L, 2)) return 1;  // nil for an integer ends ipairs
  }
  unknown_member(L, lua_tostring(L, lua_upvalueindex(4)));
}

int refuse_assignment(lua_State* L) {
  const std::string key = key_in_words(L, 2);
  throw Error(text("cannot set '", key, "': ", describe(L, 1),
                   " is immutable; operations return a new value instead"));
}

int default_tostring(lua_State* L) {
  lua_pushfstring(L, "<%s>", lua_tostring(L, lua_upvalueindex(1)));
  return 1;
}

/// "x = " .. value
int concatenate(lua_State* L) {
  for (int i : {1, 2})
    if (lua_isnil(L, i) || lua_isboolean(L, i) || lua_istable(L, i) || lua_isfunction(L, i))
      throw Error(text("attempt to concatenate ", describe(L, i)));
  luaL_tolstring(L, 1, nullptr);
  luaL_tolstring(L, 2, nullptr);
  lua_concat(L, 2);
  return 1;
}

void make_metatable(lua_State* L, const char* type) {
  lua_createtable(L, 0, 16);
  const int meta = lua_gettop(L);
  lua_newtable(L);
  lua_newtable(L);
  const int methods = meta + 1;
  const int fields = meta + 2;
  lua_pushvalue(L, methods);
  lua_rawsetp(L, meta, &methods_key);
  lua_pushvalue(L, fields);
  lua_rawsetp(L, meta, &fields_key);
  lua_pushstring(L, type);
  lua_rawsetp(L, meta, &type_key);

  lua_pushvalue(L, methods);
  lua_pushvalue(L, fields);
  lua_pushvalue(L, meta);
  lua_pushstring(L, type);
  lua_pushcclosure(L, guarded<index_object>, 4);
  lua_setfield(L, meta, "__index");
  lua_pushcfunction(L, guarded<refuse_assignment>);
  lua_setfield(L, meta, "__newindex");
  lua_pushcfunction(L, finalize);
  lua_setfield(L, meta, "__gc");
  lua_pushcfunction(L, guarded<concatenate>);
  lua_setfield(L, meta, "__concat");
  lua_pushstring(L, type);
  lua_pushcclosure(L, default_tostring, 1);
  lua_setfield(L, meta, "__tostring");
  for (const char* name : {"__name", "__metatable"}) {
    lua_pushstring(L, type);
    lua_setfield(L, meta, name);
  }
  lua_settop(L, meta);
}

void push_types(lua_State* L) {
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &types_key) == LUA_TTABLE) return;
  lua_pop(L, 1);
  lua_newtable(L);
  lua_pushvalue(L, -1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &types_key);
}

}  // namespace

namespace {

[[noreturn]] void unknown(lua_State* L, const char* type) {
  const std::string hint = text(" (list: help \"", type, "\")");
  if (lua_type(L, 2) != LUA_TSTRING) {
    const bool solution = std::strcmp(type, "solution") == 0;
    throw Error(text(describe(L, 1), " cannot be indexed with ", describe(L, 2),
                     solution ? ": its values are sol(x), at a time sol(x, 2)" : "", hint));
  }
  const std::string name = lua_tostring(L, 2);
  if (const std::string remedy = remedy_for_member(type, name); !remedy.empty())
    throw Error(text(describe(L, 1), " has no field or method '", name, "': ", remedy, hint));
  if (is_vocabulary_function(L, name))
    throw Error(text(describe(L, 1), " has no method '", name, "'; ", name, "(…) is a function: help \"",
                     name, "\" shows its arguments", hint));
  const bool variable = std::strcmp(type, "solution") == 0;
  throw Error(text(describe(L, 1), " has no field or method '", name, "'.",
                   did_you_mean(name, member_names(L, type)),
                   variable ? " The values of a variable x are sol(x), at a time sol(x, t)." : "", hint));
}

}  // namespace

void unknown_member(lua_State* L, const char* type) {
  try {
    unknown(L, type);
  } catch (const UserFacing& e) {
    throw LuaError(user_position(L) +
                   e.what());  // no function name in front, since reading a member is not a call
  }
}

void push_metatable(lua_State* L, const char* type) {
  push_types(L);
  if (lua_getfield(L, -1, type) != LUA_TTABLE) {
    lua_pop(L, 1);
    make_metatable(L, type);
    lua_pushvalue(L, -1);
    lua_setfield(L, -3, type);
  }
  lua_remove(L, -2);
}

/// The object for a table whose metatable has a function "__model" that creates the model. The table
/// keeps the result.
static std::shared_ptr<const void>* object_of_table(lua_State* L, int index, const char* type) {
  const std::string field = std::string("__") + type;
  if (!luaL_getmetafield(L, index, field.c_str())) return nullptr;
  lua_pushvalue(L, index);
  luaL_checkstack(L, 8, nullptr);
  protected_call(L, 1, 1);
  std::shared_ptr<const void>* held = object_at(L, lua_gettop(L), type);
  lua_pop(L, 1);
  return held;
}

std::shared_ptr<const void>* object_at(lua_State* L, int index, const char* type) {
  if (lua_istable(L, index)) return object_of_table(L, lua_absindex(L, index), type);
  if (lua_type(L, index) != LUA_TUSERDATA || !lua_getmetatable(L, index)) return nullptr;
  lua_rawgetp(L, -1, &type_key);
  const char* name = lua_tostring(L, -1);
  const bool match = name && std::strcmp(name, type) == 0;
  lua_pop(L, 2);
  if (!match) return nullptr;
  auto& box = *static_cast<Box*>(lua_touserdata(L, index));
  note_use(box);
  return &box.object;
}

std::vector<std::uint16_t> windows_in_use() {
  std::set<std::uint16_t> all;
  for (const Box* box = first_box; box; box = box->after)
    if (const auto* windows = std::get_if<Windows>(&box->expressions); windows && *windows)
      all.insert((*windows)->begin(), (*windows)->end());
  return {all.begin(), all.end()};
}

void touch_known_expressions() {
  for (const Box* box = first_box; box; box = box->after)
    if (const auto* known = std::get_if<Known>(&box->expressions)) known->touch(box->object.get());
}

std::string object_type(lua_State* L, int index) {
  if (lua_type(L, index) != LUA_TUSERDATA || !lua_getmetatable(L, index)) return "";
  lua_rawgetp(L, -1, &type_key);
  const char* name = lua_tostring(L, -1);
  std::string type = name ? name : "";
  lua_pop(L, 2);
  return type;
}

void push_object(lua_State* L, std::shared_ptr<const void> object, const char* type, Touch touch) {
  PENDULA_ASSERT(object != nullptr, "a null object was pushed");
  luaL_checkstack(L, 8, nullptr);
  // Empty until the metatable is set, so that nothing is leaked if Lua runs out of memory in between.
  auto* box = new (lua_newuserdatauv(L, sizeof(Box), 0)) Box;
  push_metatable(L, type);
  lua_setmetatable(L, -2);
  box->object = std::move(object);
  if (touch)
    box->expressions = Known{touch, {}};
  else
    box->expressions = Origins::so_far();
  enter(*box);
  collect_if_grown(L);
}

void Call::push_shared(lua_State* L, std::shared_ptr<const void> object, const char* type) {
  push_object(L, std::move(object), type);
}

void set_member(lua_State* L, const char* type, const char* member, Member kind) {
  push_metatable(L, type);
  lua_insert(L, -2);
  if (std::strncmp(member, "__", 2) != 0) {
    lua_rawgetp(L, -2, kind == Member::field ? &fields_key : &methods_key);
    lua_insert(L, -2);
    lua_setfield(L, -2, member);
    lua_pop(L, 2);
    return;
  }
  for (const char* reserved : {"__gc", "__metatable", "__newindex", "__name"}) {
    PENDULA_ASSERT(std::strcmp(member, reserved) != 0, "a row may not redefine this metamethod");
  }
  if (std::strcmp(member, "__index") == 0) {
    lua_rawsetp(L, -2, &fallback_key);
  } else {
    lua_setfield(L, -2, member);
  }
  lua_pop(L, 1);
}

bool push_member(lua_State* L, const char* type, const char* member) {
  push_types(L);
  if (lua_getfield(L, -1, type) != LUA_TTABLE) {
    lua_pop(L, 2);
    lua_pushnil(L);
    return false;
  }
  lua_remove(L, -2);
  if (std::strcmp(member, "__index") == 0) {
    lua_rawgetp(L, -1, &fallback_key);
  } else if (std::strncmp(member, "__", 2) == 0) {
    lua_getfield(L, -1, member);
  } else {
    lua_rawgetp(L, -1, &methods_key);
    if (lua_getfield(L, -1, member) == LUA_TNIL) {
      lua_pop(L, 2);
      lua_rawgetp(L, -1, &fields_key);
      lua_getfield(L, -1, member);
    }
    lua_remove(L, -2);
  }
  lua_remove(L, -2);
  return !lua_isnil(L, -1);
}

bool has_method(lua_State* L, const char* type, const char* member) {
  push_types(L);
  bool found = false;
  if (lua_getfield(L, -1, type) == LUA_TTABLE) {
    lua_rawgetp(L, -1, &methods_key);
    found = lua_getfield(L, -1, member) == LUA_TFUNCTION;
    lua_pop(L, 2);
  }
  lua_pop(L, 2);
  return found;
}

std::vector<std::string> type_names(lua_State* L) {
  std::vector<std::string> names;
  push_types(L);
  append_string_keys(L, -1, names);
  lua_pop(L, 1);
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> member_names(lua_State* L, const char* type) {
  std::vector<std::string> names;
  push_types(L);
  if (lua_getfield(L, -1, type) == LUA_TTABLE) {
    for (const char* key : {&methods_key, &fields_key}) {
      lua_rawgetp(L, -1, key);
      append_string_keys(L, -1, names);
      lua_pop(L, 1);
    }
  }
  lua_pop(L, 2);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace pendula::lua
