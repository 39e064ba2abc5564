#include "lua/read/traced.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "lua/core/function_reference.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {
namespace {

bool one_column(lua_State* L, int index, std::size_t count) {
  return count > 1 && parameter_names(L, index).size() == 1;
}

MatX stacked_results(lua_State* L, int base, const std::string& what) {
  const int results = lua_gettop(L) - base;
  if (results == 0) throw Error(text(what, " returned nothing"));
  if (results == 1) return to_matrix(L, base + 1, "the result of " + what);
  std::vector<Expr> all;
  for (int i = 1; i <= results; ++i) {
    const MatX part = to_matrix(L, base + i, text("result ", i, " of ", what));
    all.insert(all.end(), part.data(), part.data() + part.size());
  }
  return column(all);
}

/// r(x) by calling the function with numbers; an empty r accepts any length.
void call_with_numbers(const FunctionReference& f, bool as_column, const Vec& x, Vec& r) {
  lua_State* L = f.push();
  const int base = lua_gettop(L) - 1;
  if (as_column) {
    push_matrix(L, Mat(x));
  } else {
    luaL_checkstack(L, static_cast<int>(x.size()), nullptr);
    for (double v : x) lua_pushnumber(L, v);
  }
  protected_call(L, as_column ? 1 : static_cast<int>(x.size()), LUA_MULTRET);
  std::vector<double> all;
  for (int i = base + 1; i <= lua_gettop(L); ++i) {
    if (lua_type(L, i) == LUA_TNUMBER) {
      all.push_back(lua_tonumber(L, i));
    } else {
      const Mat part = to_numeric_matrix(L, i, "the result of the function");
      all.insert(all.end(), part.data(), part.data() + part.size());
    }
  }
  lua_settop(L, base);
  const auto count = static_cast<Eigen::Index>(all.size());
  if (r.size() > 0 && count != r.size())
    throw Error(text("the function returned ", count, " numbers, but ", r.size(), " at the start"));
  r = Eigen::Map<const Vec>(all.data(), count);
}

std::string listed(const std::vector<std::string>& names) {
  if (names.size() <= 6) return join(names, ", ");
  return join({names.begin(), names.begin() + 5}, ", ") + ", …";
}

std::vector<std::string> names_of(const std::vector<Expr>& x) {
  std::vector<std::string> names;
  for (Expr leaf : x) names.push_back(leaf_name(leaf));
  return names;
}

bool keyed_by_names(lua_State* L, int index) {
  if (!lua_istable(L, index)) return false;
  lua_pushnil(L);
  if (lua_next(L, index) == 0) return false;
  const bool named = lua_type(L, -2) != LUA_TNUMBER;
  lua_pop(L, 2);
  return named;
}

Vec read_point(lua_State* L, int index, const std::vector<Expr>& x, std::size_t n) {
  if (keyed_by_names(L, index)) {
    Vec point = Vec::Constant(static_cast<Eigen::Index>(x.size()), NAN);
    for (const auto& [leaf, value] : to_symbol_numbers(L, index, "start", x)) {
      const auto it = std::find(x.begin(), x.end(), leaf);
      if (it == x.end())
        throw Error(
            text("start: '", leaf_name(leaf), "' is not among the unknowns (", listed(names_of(x)), ")"));
      point[it - x.begin()] = value;
    }
    for (Eigen::Index i = 0; i < point.size(); ++i)
      if (std::isnan(point[i])) throw Error(text("start has no value for '", leaf_name(x[i]), "'"));
    return point;
  }
  Vec point = to_numbers(L, index, "start");
  if (n > 0 && point.size() != static_cast<Eigen::Index>(n))
    throw Error(text("start has ", point.size(), point.size() == 1 ? " number" : " numbers", " for ", n,
                     n == 1 ? " unknown" : " unknowns", " (", listed(names_of(x)), ")"));
  for (Eigen::Index i = 0; i < point.size(); ++i)
    if (!std::isfinite(point[i])) {
      const std::string name = x.empty() ? "" : " of '" + leaf_name(x[i]) + "'";
      throw Error(text("start[", i + 1, "], the start", name, ", is ", shortest(point[i]),
                       "; it must be a finite number"));
    }
  return point;
}

std::vector<Expr> variables_in(const std::vector<Expr>& r) {
  std::vector<Expr> found;
  for (Expr leaf : leaves(r))
    if (symbol_of(leaf).kind == Kind::variable) found.push_back(leaf);
  return found;
}

void read_unknowns(Call& call, const Options& options, Problem& problem) {
  if (!options.has("x")) {
    problem.x = variables_in(problem.r);
    if (problem.x.empty()) throw Error("the unknowns are missing; give x = {x, y}");
    return;
  }
  std::vector<Expr> known = leaves(problem.r);
  known.insert(known.end(), declared_symbols().begin(), declared_symbols().end());
  problem.x = to_leaves(call.L, options.push("x"), "x", known);
  lua_pop(call.L, 1);
  if (problem.x.empty()) throw Error("x is empty; list the unknowns, x = {x, y}");
  for (std::size_t i = 0; i < problem.x.size(); ++i)
    if (std::find(problem.x.begin(), problem.x.begin() + static_cast<std::ptrdiff_t>(i), problem.x[i]) !=
        problem.x.begin() + static_cast<std::ptrdiff_t>(i))
      throw Error(text("x lists '", leaf_name(problem.x[i]), "' twice"));
}

/// Values of the symbols that are not unknowns: params first, then defaults.
void read_values(Call& call, const Options& options, Problem& problem) {
  std::vector<Expr> others;
  for (Expr leaf : leaves(problem.r)) {
    if (symbol_of(leaf).kind == Kind::constant) continue;
    if (std::find(problem.x.begin(), problem.x.end(), leaf) != problem.x.end()) continue;
    others.push_back(leaf);
    if (const auto& value = symbol_of(leaf).value) problem.values[leaf] = number_value(*value).value_or(NAN);
  }
  if (!options.has("params")) return;
  const auto given = to_symbol_numbers(call.L, options.push("params"), "params", leaves(problem.r));
  lua_pop(call.L, 1);
  for (const auto& [leaf, value] : given) {
    if (std::find(others.begin(), others.end(), leaf) == others.end())
      throw Error(text("params: '", leaf_name(leaf), "' does not occur in the equations",
                       std::find(problem.x.begin(), problem.x.end(), leaf) != problem.x.end()
                           ? "; it is an unknown"
                           : ""));
    problem.values[leaf] = value;
  }
}

/// Unknowns of a Lua function without x: its parameter names, or x1 … xn.
std::vector<Expr> invented(lua_State* L, int index, std::size_t n) {
  std::vector<std::string> names = parameter_names(L, index);
  std::vector<Expr> x;
  if (names.size() == 1 && n > 1) return symbol_vector(Kind::variable, names[0], static_cast<int>(n));
  for (std::size_t i = 0; i < n; ++i)
    x.push_back(symbol(Kind::variable, names.size() == n ? names[i] : "x" + std::to_string(i + 1)));
  return x;
}

/// A Lua function r: traced if possible, else called with numbers.
void read_function(Call& call, const Options& options, const char* key, bool numbers, Problem& problem) {
  lua_State* L = call.L;
  const int top = lua_gettop(L);
  const int function = options.push(key);
  if (options.has("x")) {
    problem.x = to_leaves(L, options.push("x"), "x", declared_symbols());
    lua_pop(L, 1);
  }
  const int at = options.push("start");
  if (problem.x.empty()) {
    if (keyed_by_names(L, at))
      throw Error("with r as a function, start must be a list of numbers, or give x = {x, y}");
    problem.start = read_point(L, at, {}, 0);
    problem.x = invented(L, function, static_cast<std::size_t>(problem.start.size()));
  }
  problem.start = read_point(L, at, problem.x, problem.x.size());
  std::string why;
  if (const auto r = trace(L, function, problem.x, why)) {
    problem.r.assign(r->data(), r->data() + r->size());
    lua_settop(L, top);
    return;
  }
  if (!numbers)
    throw Error(text("the function cannot be evaluated with symbols, so its derivatives are not known: ", why,
                     "\nUse the vocabulary's functions (sin, not math.sin; ifelse, not if), or jacobian = "
                     "\"finite difference\""));
  const auto kept = std::make_shared<FunctionReference>(L, function);
  const bool as_column = one_column(L, function, problem.x.size());
  problem.f.unknowns = names_of(problem.x);
  Vec first;
  call_with_numbers(*kept, as_column, problem.start, first);
  problem.f.outputs = static_cast<int>(first.size());
  problem.f.value = [kept, as_column](const Vec& x, Vec& r) { call_with_numbers(*kept, as_column, x, r); };
  lua_settop(L, top);
}

}  // namespace

std::vector<std::string> parameter_names(lua_State* L, int index) {
  std::vector<std::string> names;
  lua_Debug info;
  lua_pushvalue(L, index);
  if (lua_getinfo(L, ">u", &info) == 0 || info.isvararg) return names;
  for (int i = 1; i <= info.nparams; ++i) {
    lua_pushvalue(L, index);
    names.emplace_back(lua_getlocal(L, nullptr, i));
    lua_pop(L, 1);
  }
  return names;
}

std::optional<MatX> trace(lua_State* L, int index, const std::vector<Expr>& arguments, std::string& why) {
  index = lua_absindex(L, index);
  const int base = lua_gettop(L);
  luaL_checkstack(L, static_cast<int>(arguments.size()) + 8, nullptr);
  lua_pushvalue(L, index);
  const bool as_column = one_column(L, index, arguments.size());
  if (as_column) {
    push_matrix(L, MatX(column(arguments)));
  } else {
    for (Expr e : arguments) push_expr(L, e);
  }
  std::optional<MatX> result;
  try {
    protected_call(L, as_column ? 1 : static_cast<int>(arguments.size()), LUA_MULTRET);
    result = stacked_results(L, base, "the function");
  } catch (const UserFacing& error) {
    why = error.what();
  }
  lua_settop(L, base);
  return result;
}

std::vector<Expr> to_residuals(lua_State* L, int index, const std::string& what) {
  const Nesting nesting(L);
  index = lua_absindex(L, index);
  if (lua_isboolean(L, index))
    throw Error(text(what, " must be an expression or an equation, not a boolean: write ~, not =="));
  if (object_at(L, index, TypeName<Equation>::value)) {
    const Equation e = to_equations(L, index, what)[0];
    const MatX difference = e.lhs - e.rhs;
    return {difference.data(), difference.data() + difference.size()};
  }
  std::vector<Expr> all;
  if (!lua_istable(L, index)) {
    const MatX m = to_matrix(L, index, what);
    return {m.data(), m.data() + m.size()};
  }
  for (lua_Integer i = 1, n = list_size(L, index, what); i <= n; ++i) {
    lua_rawgeti(L, index, i);
    const auto some = to_residuals(L, lua_gettop(L), text("entry ", i, " of ", what));
    all.insert(all.end(), some.begin(), some.end());
    lua_pop(L, 1);
  }
  return all;
}

Problem read_problem(Call& call, const Options& options, const char* key, bool numbers) {
  Problem problem;
  lua_State* L = call.L;
  const int top = lua_gettop(L);
  if (!options.has(key))
    throw Error(text("the equations are missing; give ", key, " = { … }, expressions that become zero"));
  if (!options.has("start"))
    throw Error("the start is missing; give start = {1, 1}, one number for every unknown");
  const bool function = lua_isfunction(L, options.push(key));
  lua_settop(L, top);
  if (function) {
    read_function(call, options, key, numbers, problem);
    if (problem.r.empty()) return problem;
  } else {
    problem.r = to_residuals(L, options.push(key), key);
    lua_settop(L, top);
    if (problem.r.empty()) throw Error(text(key, " is empty; give the expressions that become zero"));
    read_unknowns(call, options, problem);
  }
  read_values(call, options, problem);
  if (!function) {
    problem.start = read_point(L, options.push("start"), problem.x, problem.x.size());
    lua_settop(L, top);
  }
  problem.f = lab::compile(problem.r, problem.x, problem.values);
  return problem;
}

}  // namespace pendula::lua
