// Objects in Lua: a userdata that shares ownership of an immutable C++ value, and
// one metatable per type name.
//
//   metatable = {
//     __name = type, __metatable = type,              -- a script sees getmetatable(object): the type
//     __index, __newindex, __gc, __tostring, __concat,
//     __add, …                                        -- rows "type:__add"
//     [methods] = { name = function },                -- rows "type:name"
//     [fields] = { name = function },                 -- rows "type#name"
//     [fallback] = function,                          -- row "type:__index"
//   }
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <lua.hpp>

namespace pendula::lua {

/// The pointer inside the userdata at `index` if it is one of ours and of this type, else nullptr. The
/// pointer itself is null when the object was finalized and resurrected by a script's __gc. A table whose
/// metatable has a function "__model" is a model, too: the function gives it, and the table has to keep it.
std::shared_ptr<const void>* object_at(lua_State* L, int index, const char* type);

/// Pushes the metatable of a type; the first use makes it.
void push_metatable(lua_State* L, const char* type);

/// Pops a function and makes it `member` of the type: a method, a field (computed when read), or, when the
/// name starts with two underscores, a metamethod.
enum class Member { method, field };
void set_member(lua_State* L, const char* type, const char* member, Member kind);

/// Pushes a method, field or metamethod; nil (and false) if the type has
/// none of that name. Never makes a type.
bool push_member(lua_State* L, const char* type, const char* member);

/// Has the type a method of this name (a field is none)?
bool has_method(lua_State* L, const char* type, const char* member);

/// The names of all types so far, and a type's methods and fields, sorted. For help and completion.
std::vector<std::string> type_names(lua_State* L);
std::vector<std::string> member_names(lua_State* L, const char* type);

/// Throws Error: the object at 1 has no member of the name at 2, and what to write instead.
[[noreturn]] void unknown_member(lua_State* L, const char* type);

/// Of the objects that Lua has not collected yet: the windows of the expressions in them (give_back() in
/// expr/graph/graph.hpp), and a touch of those that are known one by one. Cost: O(objects).
std::vector<std::uint16_t> windows_in_use();
void touch_known_expressions();

/// The type name of one of our objects, or "".
std::string object_type(lua_State* L, int index);

}  // namespace pendula::lua
