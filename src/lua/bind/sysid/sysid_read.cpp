// Signals, names and numbers of channels from Lua.
#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;

namespace {

/// A list of numbers; reports nil holes and keeps NaN.
std::vector<double> numbers_of(lua_State* L, int list, const std::string& what) {
  std::vector<double> out;
  for (lua_Integer i = 1, n = list_size(L, list, what); i <= n; ++i) {
    lua_rawgeti(L, list, i);
    out.push_back(to_number(L, lua_gettop(L), text("entry ", i, " of ", what)));
    lua_pop(L, 1);
  }
  return out;
}

Mat rows_of_lists(lua_State* L, int list, lua_Integer n, const std::string& what) {
  std::vector<std::vector<double>> rows;
  for (lua_Integer i = 1; i <= n; ++i) {
    lua_rawgeti(L, list, i);
    const int top = lua_gettop(L);
    const std::string where = text("entry ", i, " of ", what);
    if (lua_istable(L, top)) {
      rows.push_back(numbers_of(L, top, where));
    } else {
      const Vec v = to_data(L, top, where).reshaped();
      rows.emplace_back(v.begin(), v.end());
    }
    if (rows.back().size() != rows[0].size())
      throw Error(text(where, " has ", rows.back().size(), " numbers but entry 1 has ", rows[0].size()));
    lua_pop(L, 1);
  }
  Mat m(static_cast<Index>(rows.size()), static_cast<Index>(rows[0].size()));
  for (Index i = 0; i < m.rows(); ++i) m.row(i) = Eigen::Map<const Vec>(rows[i].data(), m.cols());
  return m;
}

}  // namespace

Mat to_data(lua_State* L, int index, const std::string& what, Index rows) {
  index = lua_absindex(L, index);
  luaL_checkstack(L, 8, nullptr);
  Mat m;
  bool columns = false;
  if (lua_istable(L, index)) {
    const lua_Integer n = list_size(L, index, what);
    if (n == 0) throw Error(text(what, " is an empty list"));
    lua_rawgeti(L, index, 1);
    const bool nested = lua_istable(L, -1) || object_at(L, lua_gettop(L), TypeName<Matrix>::value);
    columns = nested && !lua_istable(L, -1);
    lua_pop(L, 1);
    if (nested) {
      m = rows_of_lists(L, index, n, what);
      if (columns && rows != m.rows()) m.transposeInPlace();
    } else {
      const std::vector<double> v = numbers_of(L, index, what);
      m = Eigen::Map<const Vec>(v.data(), static_cast<Index>(v.size()));
    }
  } else {
    m = to_numeric_matrix(L, index, what);
  }
  if ((m.rows() == 1 && m.cols() > 1 && rows != 1) || (rows > 0 && m.rows() != rows && m.cols() == rows))
    m.transposeInPlace();
  return m;
}

SimulationData simulation_data(Call& call, Index inputs, Index outputs, double Ts) {
  const bool alone = lua_istable(call.L, 2) || object_at(call.L, 2, TypeName<Matrix>::value);
  if (!alone) return {call.object<IdData>(2, "data or inputs"), false};
  IdData d;
  d.u = to_data(call.L, 2, "u");
  if (d.u.cols() != inputs && d.u.rows() == inputs) d.u.transposeInPlace();
  d.y = Mat::Zero(d.u.rows(), outputs);
  d.Ts = Ts;
  return {sysid::checked(std::move(d)), true};
}

std::vector<std::string> to_words(lua_State* L, int index, const std::string& what) {
  index = lua_absindex(L, index);
  const auto word = [&](int at) {
    if (lua_isinteger(L, at)) return std::to_string(lua_tointeger(L, at));
    if (lua_type(L, at) != LUA_TSTRING)
      throw Error(text(what, " must be a name or a list of names, not ", describe(L, at)));
    return std::string(lua_tostring(L, at));
  };
  if (!lua_istable(L, index)) return {word(index)};
  std::vector<std::string> out;
  for (lua_Integer i = 1, n = list_size(L, index, what); i <= n; ++i) {
    lua_rawgeti(L, index, i);
    out.push_back(word(lua_gettop(L)));
    lua_pop(L, 1);
  }
  return out;
}

std::vector<int> to_whole_numbers(lua_State* L, int index, const std::string& what) {
  const Mat m = to_data(L, index, what);
  std::vector<int> out;
  for (const double v : m.reshaped()) {
    if (v != std::round(v) || std::abs(v) > 1e9)
      throw Error(text(what, " must be a whole number, got ", shortest(v)));
    out.push_back(static_cast<int>(v));
  }
  if (out.empty()) throw Error(text(what, " is an empty list; give a whole number"));
  return out;
}

int push_words(lua_State* L, const std::vector<std::string>& words) {
  lua_createtable(L, static_cast<int>(words.size()), 0);
  lua_Integer i = 0;
  for (const std::string& w : words) {
    lua_pushlstring(L, w.data(), w.size());
    lua_rawseti(L, -2, ++i);
  }
  return 1;
}

}  // namespace pendula::lua
