#include "lua/core/library.hpp"

#include <algorithm>
#include <cctype>

#include "base/error.hpp"
#include "base/text.hpp"
#include "lua/core/embedded.hpp"
#include "lua/core/foreign_names.hpp"
#include "lua/core/key_in_words.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {

namespace {

char environment_key, originals_key, vocabulary_key, modules_key;
///< in the metatable of a library table: name -> function that creates the value
constexpr const char* lazy_field = "__lazy";

void push_registry(lua_State* L, const char* key) { lua_rawgetp(L, LUA_REGISTRYINDEX, key); }

/// The types that have a method of this name, as in "a model or lti"; "" if there is none.
std::string type_with_method(lua_State* L, const std::string& name) {
  std::vector<std::string> owners;
  if (name.size() < 3) return "";  // names like x and dt are more likely undeclared variables
  for (const std::string& type : type_names(L))
    if (has_method(L, type.c_str(), name.c_str())) owners.push_back(type);
  if (owners.size() > 3) owners.resize(3);
  return owners.empty() ? "" : "of type " + join(owners, " or ");
}

void append_names(lua_State* L, std::vector<std::string>& names) {
  lua_pushnil(L);
  while (lua_next(L, -2) != 0) {
    lua_pop(L, 1);
    if (lua_type(L, -1) == LUA_TSTRING) names.emplace_back(lua_tostring(L, -1));
  }
}

/// __index of _G and of the environment of the stdlib.
int undefined_global(lua_State* L) {
  if (lua_type(L, 2) != LUA_TSTRING) return 0;
  const std::string name = lua_tostring(L, 2);
  if (const std::string remedy = remedy_for_name(name); !remedy.empty())
    throw Error(text("undefined variable '", name, "': ", remedy));
  if (const std::string owner = type_with_method(L, name); !owner.empty())
    throw Error(text("undefined variable '", name, "'; it is a method: write x:", name, "() where x is ",
                     owner, " (help \"", name, "\")"));
  std::string hint = did_you_mean(name, global_names(L));
  constexpr std::size_t letters = 2, symbol_like = 5;  // mathematical symbols that were not declared
  if (name.size() <= letters || (hint.empty() && name.size() <= symbol_like))
    hint = text(" A parameter is ", name, " = param(\"", name, "\", 1), an unknown ", name, " = var \"", name,
                "\".");
  throw Error(text("undefined variable '", name, "'.", hint));
}

/// The closest entry for a name from other programs, as in rk.RK45 or rk.bdf2; "" if there is none.
std::string tableau_like(const std::string& name, const std::vector<std::string>& tableaus) {
  std::string like = method_like(name);
  if (like.empty()) {
    like = name;
    std::transform(like.begin(), like.end(), like.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return std::find(tableaus.begin(), tableaus.end(), like) == tableaus.end()
               ? ""
               : " Did you mean '" + like + "'?";
  }
  if (like == "auto") return "";
  const bool listed = std::find(tableaus.begin(), tableaus.end(), like) != tableaus.end();
  return listed ? text(" The nearest name is rk.", like, " (print(rk) lists them).")
                : text(" The nearest method is not a tableau: integrate{ …, method = \"", like, "\" }.");
}

/// __index of a library table such as rk; creates entries that were installed lazily. Upvalue:
/// the table's name.
int unknown_entry(lua_State* L) {
  const std::string library = lua_tostring(L, lua_upvalueindex(1));
  std::vector<std::string> names;
  if (luaL_getmetafield(L, 1, lazy_field) == LUA_TTABLE) {
    lua_pushvalue(L, 2);
    if (lua_rawget(L, -2) == LUA_TFUNCTION) {
      lua_call(L, 0, 1);
      lua_pushvalue(L, 2);
      lua_pushvalue(L, -2);
      lua_rawset(L, 1);
      return 1;
    }
    lua_pop(L, 1);
    append_names(L, names);
  }
  lua_settop(L, 2);
  const std::string key = key_in_words(L, 2);
  lua_pushvalue(L, 1);
  append_names(L, names);
  std::string hint = did_you_mean(key, names);
  if (hint.empty() && library == "rk") hint = tableau_like(key, names);
  throw Error(text("'", library, "' has no entry '", key, "'.", hint));
}

/// The iterator of pairs(rk): the next name and its value, created if necessary. Upvalues: the table, the
/// names, the number of names already returned.
int next_entry(lua_State* L) {
  const lua_Integer i = lua_tointeger(L, lua_upvalueindex(3)) + 1;
  lua_pushinteger(L, i);
  lua_replace(L, lua_upvalueindex(3));
  if (lua_geti(L, lua_upvalueindex(2), i) == LUA_TNIL) return 1;
  lua_pushvalue(L, -1);
  lua_gettable(L, lua_upvalueindex(1));
  return 2;
}

/// __pairs of a library table: all its names in order, including those not created yet.
int library_pairs(lua_State* L) {
  std::vector<std::string> names;
  if (luaL_getmetafield(L, 1, lazy_field) == LUA_TTABLE) append_names(L, names);
  lua_settop(L, 1);
  lua_pushvalue(L, 1);
  append_names(L, names);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  lua_settop(L, 1);
  lua_createtable(L, static_cast<int>(names.size()), 0);
  for (std::size_t i = 0; i < names.size(); ++i) {
    lua_pushlstring(L, names[i].data(), names[i].size());
    lua_seti(L, 2, static_cast<lua_Integer>(i) + 1);
  }
  lua_pushinteger(L, 0);
  lua_pushcclosure(L, guarded<next_entry>, 3);
  return 1;
}

/// __call of a library table that is also a function, such as dae. Upvalue: the function.
int call_library(lua_State* L) {
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_replace(L, 1);
  lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
  return lua_gettop(L);
}

/// "components: electrical, …" and how to get help; for a table that is also a function its name.
int library_tostring(lua_State* L) {
  const std::string library = lua_tostring(L, lua_upvalueindex(1));
  lua_settop(L, 1);
  std::vector<std::string> names;
  if (luaL_getmetafield(L, 1, "__call") == LUA_TNIL) {
    lua_settop(L, 1);
    if (luaL_getmetafield(L, 1, lazy_field) == LUA_TTABLE) append_names(L, names);
    lua_settop(L, 1);
    append_names(L, names);
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
  }
  constexpr std::size_t width = 80;
  std::string out = library + (names.empty() ? "" : ":");
  std::size_t column = out.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string word = names[i] + (i + 1 < names.size() ? "," : "");
    const bool fits = column + 1 + word.size() <= width;
    out += (fits ? " " : "\n  ") + word;
    column = (fits ? column + 1 : 2) + word.size();
  }
  if (!names.empty()) out += text("\nhelp(", library, ") explains them");
  lua_pushlstring(L, out.data(), out.size());
  return 1;
}

/// Gives the table on top a metatable that makes unknown keys errors.
void make_strict(lua_State* L, const std::string& name, lua_CFunction index) {
  lua_createtable(L, 0, 4);
  lua_pushlstring(L, name.data(), name.size());
  lua_pushcclosure(L, index, 1);
  lua_setfield(L, -2, "__index");
  lua_pushlstring(L, name.data(), name.size());
  lua_pushcclosure(L, library_tostring, 1);
  lua_setfield(L, -2, "__tostring");
  for (const char* field : {"__metatable", "__name"}) {
    lua_pushlstring(L, name.data(), name.size());
    lua_setfield(L, -2, field);
  }
  lua_setmetatable(L, -2);
}

/// Pops a value and sets pendula[name], _G[name] and the entry of the stdlib environment.
void set_global(lua_State* L, const std::string& name) {
  for (const char* where : {&vocabulary_key, &originals_key}) {
    push_registry(L, where);
    lua_pushlstring(L, name.data(), name.size());
    lua_pushvalue(L, -3);
    lua_rawset(L, -3);
    lua_pop(L, 1);
  }
  lua_pushglobaltable(L);
  lua_pushlstring(L, name.data(), name.size());
  lua_pushvalue(L, -3);
  lua_rawset(L, -3);
  lua_pop(L, 2);
}

/// Pushes pendula[name] without raising "unknown entry"; returns its type.
int push_global(lua_State* L, const std::string& name) {
  push_registry(L, &vocabulary_key);
  lua_pushlstring(L, name.data(), name.size());
  const int type = lua_rawget(L, -2);
  lua_remove(L, -2);
  return type;
}

/// Pops a function, which becomes the __call of the library.
void make_callable(lua_State* L, const std::string& library) {
  push_global(L, library);
  lua_getmetatable(L, -1);
  lua_pushvalue(L, -3);
  lua_pushcclosure(L, call_library, 1);
  lua_setfield(L, -2, "__call");
  lua_pop(L, 3);
}

/// Pushes the library table, which is created if necessary; a function of that name becomes its __call.
void push_library_table(lua_State* L, const std::string& library) {
  const int type = push_global(L, library);
  if (type == LUA_TTABLE) return;
  lua_newtable(L);
  make_strict(L, library, guarded<unknown_entry>);
  lua_getmetatable(L, -1);
  lua_pushcfunction(L, guarded<library_pairs>);
  lua_setfield(L, -2, "__pairs");
  lua_pop(L, 1);
  lua_pushvalue(L, -1);
  set_global(L, library);
  if (type == LUA_TFUNCTION) {
    lua_pushvalue(L, -2);
    make_callable(L, library);
  }
  lua_remove(L, -2);
}

/// Pushes a copy of the globals and, one level deep, of the tables among them.
void push_copy_of_globals(lua_State* L) {
  lua_newtable(L);
  const int copy = lua_gettop(L);
  lua_pushglobaltable(L);
  lua_pushnil(L);
  while (lua_next(L, -2) != 0) {
    lua_pushvalue(L, -2);  // … key value key
    if (lua_istable(L, -2) && !lua_rawequal(L, -2, copy + 1)) {
      lua_newtable(L);
      lua_pushnil(L);
      while (lua_next(L, -4) != 0) {
        lua_pushvalue(L, -2);
        lua_insert(L, -2);
        lua_rawset(L, -4);
      }
    } else {
      lua_pushvalue(L, -2);
    }
    lua_rawset(L, copy);
    lua_pop(L, 1);
  }
  lua_settop(L, copy);
}

/// Looks methods of strings up in our copy first, so that a script that changes the table `string` cannot
/// break the stdlib; additions of the script are found after that.
void protect_string_methods(lua_State* L) {
  push_registry(L, &originals_key);
  lua_getfield(L, -1, "string");
  lua_createtable(L, 0, 1);
  lua_getglobal(L, "string");
  lua_setfield(L, -2, "__index");
  lua_setmetatable(L, -2);
  lua_pushliteral(L, "");
  lua_getmetatable(L, -1);
  lua_pushvalue(L, -3);
  lua_setfield(L, -2, "__index");
  lua_pop(L, 4);
}

}  // namespace

void open_library(lua_State* L) {
  push_copy_of_globals(L);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &originals_key);
  protect_string_methods(L);
  lua_newtable(L);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &modules_key);

  lua_newtable(L);
  make_strict(L, "pendula", guarded<unknown_entry>);
  lua_pushvalue(L, -1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &vocabulary_key);
  push_registry(L, &originals_key);
  lua_pushvalue(L, -2);
  lua_setfield(L, -2, "pendula");
  lua_pop(L, 1);
  lua_setglobal(L, "pendula");

  lua_pushglobaltable(L);
  make_strict(L, "_G", guarded<undefined_global>);
  lua_pop(L, 1);

  // The stdlib's definitions go into `environment`; reads fall back to the original globals.
  push_registry(L, &originals_key);
  make_strict(L, "stdlib", guarded<undefined_global>);
  lua_newtable(L);
  lua_createtable(L, 0, 1);
  lua_pushvalue(L, -3);
  lua_setfield(L, -2, "__index");
  lua_setmetatable(L, -2);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &environment_key);
  lua_pop(L, 1);
}

void push_stdlib_environment(lua_State* L) { push_registry(L, &environment_key); }

void push_vocabulary(lua_State* L, const std::string& name) { push_global(L, name); }

bool is_vocabulary_function(lua_State* L, const std::string& name) {
  const bool function = push_global(L, name) == LUA_TFUNCTION;
  lua_pop(L, 1);
  return function;
}

std::vector<std::string> global_names(lua_State* L) {
  std::vector<std::string> names;
  lua_pushglobaltable(L);
  append_names(L, names);
  push_registry(L, &vocabulary_key);
  append_names(L, names);
  lua_pop(L, 2);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

void install(lua_State* L, const std::string& name) {
  const size_t separator = name.find_first_of(":#.");
  if (separator == std::string::npos) {
    if (push_global(L, name) == LUA_TTABLE && lua_isfunction(L, -2)) {
      lua_pop(L, 1);
      make_callable(L, name);
    } else {
      lua_pop(L, 1);
      set_global(L, name);
    }
    return;
  }
  const std::string owner = name.substr(0, separator);
  const std::string member = name.substr(separator + 1);
  if (name[separator] != '.') {
    set_member(L, owner.c_str(), member.c_str(), name[separator] == '#' ? Member::field : Member::method);
    return;
  }
  push_library_table(L, owner);
  lua_pushlstring(L, member.data(), member.size());
  lua_pushvalue(L, -3);
  lua_rawset(L, -3);
  lua_pop(L, 2);
}

void install_lazy(lua_State* L, const std::string& name) {
  const size_t separator = name.find('.');
  if (separator == std::string::npos)
    throw std::logic_error(name + ": only entries of a library can be lazy");
  push_library_table(L, name.substr(0, separator));
  lua_getmetatable(L, -1);
  if (lua_getfield(L, -1, lazy_field) != LUA_TTABLE) {
    lua_pop(L, 1);
    lua_newtable(L);
    lua_pushvalue(L, -1);
    lua_setfield(L, -3, lazy_field);
  }
  lua_pushvalue(L, -4);
  lua_setfield(L, -2, name.substr(separator + 1).c_str());
  lua_pop(L, 4);
}

void push_named(lua_State* L, const std::string& name) {
  const size_t separator = name.find_first_of(":#.");
  if (separator == std::string::npos) {
    push_global(L, name);
    return;
  }
  const std::string owner = name.substr(0, separator);
  const std::string member = name.substr(separator + 1);
  if (name[separator] != '.') {
    push_member(L, owner.c_str(), member.c_str());
    return;
  }
  if (push_global(L, owner) == LUA_TTABLE) {
    lua_pushlstring(L, member.data(), member.size());
    lua_rawget(L, -2);
  } else {
    lua_pushnil(L);
  }
  lua_remove(L, -2);
}

std::vector<const Module*> added_modules(lua_State* L) {
  std::vector<const Module*> modules;
  push_registry(L, &modules_key);
  for (lua_Integer i = 1; lua_rawgeti(L, -1, i) == LUA_TLIGHTUSERDATA; ++i) {
    modules.push_back(static_cast<const Module*>(lua_touserdata(L, -1)));
    lua_pop(L, 1);
  }
  lua_pop(L, 2);
  return modules;
}

void add_module(lua_State* L, const Module& module) {
  push_registry(L, &modules_key);
  lua_pushlightuserdata(L, const_cast<Module*>(&module));
  lua_rawseti(L, -2, static_cast<lua_Integer>(lua_rawlen(L, -2)) + 1);
  lua_pop(L, 1);
  for (const Row& row : module.rows) {
    push_row(L, row);
    if (row.name[0] == '=') {
      lua_call(L, 0, 1);
      install(L, row.name + 1);
    } else {
      install(L, row.name);
    }
  }
}

void include_embedded(lua_State* L, const std::string& name) {
  const std::string file = name + ".lua";
  for (const EmbeddedFile& chunk : embedded_stdlib()) {
    if (file != chunk.name) continue;
    const std::string chunk_name = "=stdlib/" + file;
    if (luaL_loadbufferx(L, reinterpret_cast<const char*>(chunk.bytes), chunk.size, chunk_name.c_str(),
                         "b")) {
      throw std::logic_error(text("embedded ", chunk_name, ": ", error_text(L, -1)));
    }
    push_stdlib_environment(L);
    lua_setupvalue(L, -2, 1);
    lua_call(L, 0, 1);
    return;
  }
  throw std::logic_error(text("there is no embedded file stdlib/", file));
}

}  // namespace pendula::lua
