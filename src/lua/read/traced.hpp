// Functions of numbers, given as expressions or as Lua functions: what newton, gauss_newton and fn read.
//
// A Lua function is called once with symbols; if that gives expressions, its derivatives are exact (tracing).
//
// The folder has what several folders of lua/bind read: traced.hpp (here), inputs.hpp: known functions of
// time, iddata.hpp: data sets as inputs.
#pragma once

#include <optional>
#include <unordered_map>

#include "lab/numeric_function.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

/// The results of the Lua function at `index` for symbolic arguments: several results, or one of any shape.
/// A function of one parameter gets several arguments as one column. Nothing (and the reason in `why`) if the
/// function cannot be followed symbolically.
std::optional<MatX> trace(lua_State* L, int index, const std::vector<Expr>& arguments, std::string& why);

/// The names of a Lua function's parameters ("x", "y"); empty for a vararg or C function.
std::vector<std::string> parameter_names(lua_State* L, int index);

/// r, x, start and params of a laboratory.
struct Problem {
  std::vector<Expr> r;  ///< empty if r is a Lua function that could not be traced
  std::vector<Expr> x;
  std::unordered_map<Expr, double> values;  ///< of everything else
  lab::NumericFunction f;
  Vec start;
};

/// Reads the options r (called `key`), x, start, params. Without x the variables of r are the unknowns.
/// `numbers`: a Lua function that cannot be traced may be called with numbers.
/// Throws Error on what is missing, not an expression, of the wrong size or not finite.
Problem read_problem(Call& call, const Options& options, const char* key, bool numbers);

/// Residuals: expressions, columns and equations (lhs - rhs) in any mix.
/// Throws Error on booleans ("write ~").
std::vector<Expr> to_residuals(lua_State* L, int index, const std::string& what);

}  // namespace pendula::lua
