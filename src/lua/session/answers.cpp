#include "lua/session/answers.hpp"

#include "expr/graph/matrix.hpp"
#include "lua/core/library.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

namespace {

char values_key, lines_key;  // registry: assigned values, and the lines of assignment

/// __newindex of _G. Upvalue: the set of names.
int assign(lua_State* L) {
  lua_pushvalue(L, 2);
  if (lua_type(L, 2) != LUA_TSTRING || lua_rawget(L, lua_upvalueindex(1)) == LUA_TNIL) {
    lua_settop(L, 3);
    lua_rawset(L, 1);
    return 0;
  }
  lua_settop(L, 3);
  lua_Debug frame{};
  int line = 0;
  if (lua_getstack(L, 1, &frame) != 0 && lua_getinfo(L, "l", &frame) != 0) line = frame.currentline;
  lua_rawgetp(L, LUA_REGISTRYINDEX, &values_key);
  lua_pushvalue(L, 2);
  lua_pushvalue(L, 3);
  lua_rawset(L, -3);
  lua_rawgetp(L, LUA_REGISTRYINDEX, &lines_key);
  lua_pushvalue(L, 2);
  lua_pushinteger(L, line);
  lua_rawset(L, -3);
  return 0;
}

/// __index of _G. Upvalues: the set of names, the original.
int look_up(lua_State* L) {
  lua_pushvalue(L, 2);
  if (lua_type(L, 2) == LUA_TSTRING && lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) {
    lua_rawgetp(L, LUA_REGISTRYINDEX, &values_key);
    lua_pushvalue(L, 2);
    if (lua_rawget(L, -2) != LUA_TNIL) return 1;
  }
  lua_settop(L, 2);
  lua_pushvalue(L, lua_upvalueindex(2));
  lua_insert(L, 1);
  lua_call(L, 2, 1);
  return 1;
}

/// leaves_of(list of expressions): their symbols and derivatives, names and values.
int leaves_of(lua_State* L) {
  const MatX all = to_matrix(L, 1, "the expressions");
  const std::vector<Expr> list(all.data(), all.data() + all.size());
  lua_newtable(L);
  lua_newtable(L);
  lua_Integer count = 0;
  for (Expr leaf : leaves(list)) {
    if (symbol_of(leaf).kind == Kind::constant) continue;
    lua_pushstring(L, leaf_name(leaf).c_str());
    lua_rawseti(L, -3, ++count);
    push_expr(L, leaf);
    lua_rawseti(L, -2, count);
  }
  return 2;
}

/// Pushes stdlib/grade, loaded once.
void push_grader(lua_State* L) {
  static char key;
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &key) == LUA_TTABLE) return;
  lua_pop(L, 1);
  push_stdlib_environment(L);
  lua_pushcfunction(L, guarded<leaves_of>);
  lua_setfield(L, -2, "leaves_of");
  lua_pop(L, 1);
  include_embedded(L, "grade/grade");
  lua_pushvalue(L, -1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &key);
}

std::string string_at(lua_State* L, int index) {
  std::size_t size = 0;
  const char* bytes = lua_tolstring(L, index, &size);
  return bytes ? std::string(bytes, size) : std::string();
}

}  // namespace

void record_answers(lua_State* L, const std::vector<std::string>& names) {
  for (char* key : {&values_key, &lines_key}) {
    lua_newtable(L);
    lua_rawsetp(L, LUA_REGISTRYINDEX, key);
  }
  lua_newtable(L);
  for (const std::string& name : names) {
    lua_pushboolean(L, 1);
    lua_setfield(L, -2, name.c_str());
  }
  lua_pushglobaltable(L);
  lua_getmetatable(L, -1);  // the strict metatable made by open_library
  lua_pushvalue(L, -3);
  lua_pushcclosure(L, assign, 1);
  lua_setfield(L, -2, "__newindex");
  lua_pushvalue(L, -3);
  lua_getfield(L, -2, "__index");
  lua_pushcclosure(L, look_up, 2);
  lua_setfield(L, -2, "__index");
  lua_pop(L, 3);
}

std::vector<Answer> answers(lua_State* L, const std::vector<std::string>& names) {
  std::vector<Answer> list;
  lua_rawgetp(L, LUA_REGISTRYINDEX, &values_key);
  const int values = lua_gettop(L);
  lua_rawgetp(L, LUA_REGISTRYINDEX, &lines_key);
  for (const std::string& name : names) {
    lua_settop(L, values + 1);
    if (lua_getfield(L, values, name.c_str()) == LUA_TNIL) continue;
    lua_getfield(L, values + 1, name.c_str());
    const std::string line = string_at(L, -1);
    push_grader(L);
    lua_getfield(L, -1, "text_of");
    lua_pushvalue(L, values + 2);
    protected_call(L, 1, 1);
    list.push_back({name, line, string_at(L, -1)});
  }
  lua_settop(L, values - 1);
  return list;
}

std::vector<std::vector<std::string>> call_grader(lua_State* L, const std::string& function,
                                                  const std::vector<std::string>& arguments) {
  const int base = lua_gettop(L);
  push_grader(L);
  lua_getfield(L, -1, function.c_str());
  for (const std::string& argument : arguments) lua_pushlstring(L, argument.data(), argument.size());
  protected_call(L, static_cast<int>(arguments.size()), 1);
  std::vector<std::vector<std::string>> rows;
  if (lua_istable(L, -1))
    for (lua_Integer i = 1; lua_rawgeti(L, -1, i) == LUA_TTABLE; ++i) {
      rows.emplace_back();
      for (lua_Integer k = 1; lua_rawgeti(L, -1, k) != LUA_TNIL; ++k) {
        rows.back().push_back(string_at(L, -1));
        lua_pop(L, 1);
      }
      lua_pop(L, 2);
    }
  lua_settop(L, base);
  return rows;
}

}  // namespace pendula::lua
