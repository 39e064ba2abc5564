// Systems, names and states between Lua and C++.
#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

lti::System read_system(Call& call, int i, const char* name) {
  if (call.is<lti::System>(i)) return call.object<lti::System>(i, name);
  if (call.is<lti::DelaySystem>(i))
    throw Error(text(name, " has delays; pade(", name, ", n) makes it rational"));
  if (!call.has(i) || (!is_expression(call.L, i) && !lua_istable(call.L, i) && !call.is<Matrix>(i)))
    call.wrong(i, name, "a linear system (ss, tf, zpk) or a gain");
  return lti::make_gain(to_matrix(call.L, i, name));
}

int push_system(Call& call, lti::System g) {
  return call.push(std::make_shared<const lti::System>(std::move(g)));
}

int push_entries(lua_State* L, const MatX& m) {
  if (lti::field(m) == lti::Field::numeric) return push_matrix(L, lti::numbers(m));
  return push_matrix(L, m);
}

int push_number_or_expression(lua_State* L, Expr e) {
  if (!e.is_constant()) return push_expr(L, e);
  const double v = lti::number(e);
  if (v == std::round(v) && std::abs(v) < 1e15)
    lua_pushinteger(L, static_cast<lua_Integer>(v));
  else
    lua_pushnumber(L, v);
  return 1;
}

int push_entries_or_one(lua_State* L, const MatX& m) {
  return m.size() == 1 ? push_expr(L, m(0, 0)) : push_entries(L, m);
}

std::vector<std::string> read_names(lua_State* L, int index, const std::string& what) {
  std::vector<std::string> names;
  const auto add = [&](int at) {
    if (lua_type(L, at) == LUA_TSTRING) {
      for (std::string& word : split_words(lua_tostring(L, at))) names.push_back(std::move(word));
      return;
    }
    const MatX symbols = to_matrix(L, at, what);
    for (Eigen::Index k = 0; k < symbols.size(); ++k) names.push_back(to_text(symbols.data()[k]));
  };
  if (lua_istable(L, index)) {
    const int list = lua_absindex(L, index);
    for (lua_Integer i = 1, n = list_size(L, list, what); i <= n; ++i) {
      lua_rawgeti(L, list, i);
      add(lua_gettop(L));
      lua_pop(L, 1);
    }
  } else {
    add(lua_absindex(L, index));
  }
  for (std::size_t i = 0; i < names.size(); ++i)
    if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), names[i]) !=
        names.begin() + static_cast<std::ptrdiff_t>(i))
      throw Error(text(what, ": the name '", names[i], "' occurs twice"));
  return names;
}

int push_names(lua_State* L, const std::vector<std::string>& names) {
  lua_createtable(L, static_cast<int>(names.size()), 0);
  for (std::size_t i = 0; i < names.size(); ++i) {
    lua_pushlstring(L, names[i].data(), names[i].size());
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  return 1;
}

VecX read_state(lua_State* L, int index, const std::string& what, const lti::System& g) {
  const int n = g.ss.order();
  if (!lua_istable(L, index) || lua_rawlen(L, index) > 0) {
    const VecX x = to_column(L, index, what);
    if (x.size() != n)
      throw Error(text(what, " has ", x.size(), x.size() == 1 ? " entry" : " entries", " for ", n,
                       n == 1 ? " state" : " states"));
    return x;
  }
  std::vector<std::string> names;
  for (int i = 0; i < n; ++i) names.push_back(lti::state_name(g, i));
  VecX x = VecX::Zero(n);
  const int table = lua_absindex(L, index);
  for (lua_pushnil(L); lua_next(L, table); lua_pop(L, 1)) {
    lua_pushvalue(L, -2);
    const std::string key = luaL_tolstring(L, -1, nullptr);
    lua_pop(L, 2);
    const auto at = std::find(names.begin(), names.end(), key);
    if (at == names.end())
      throw Error(text(what, ": there is no state '", key, "'.", did_you_mean(key, names),
                       " (states: ", join(names, ", "), ")"));
    x[at - names.begin()] = to_expr(L, lua_gettop(L), what + "." + key);
  }
  return x;
}

}  // namespace pendula::lua
