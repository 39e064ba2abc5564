// inputs = { [u] = function(t) … end | expression in t | number | samples }: how known functions of time are
// given. Samples: { t = {…}, u = {…} }, { Ts = 0.1, u = {…} }, an N×2 matrix of rows (t, u), or iddata.
#pragma once

#include <functional>

#include "dae/model/model.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

/// An input that is called with numbers: samples, or a function that could not be traced to an expression.
struct NumericInput {
  Expr leaf;
  std::function<double(double)> value;  ///< may call back into Lua: main thread only
  bool may_jump = true;                 ///< nothing is known about it; samples tell where they jump
};

struct Inputs {
  Substitution
      expressions;  ///< every input leaf of the model, derivatives included, where it is known exactly
  std::vector<NumericInput> numeric;  ///< the rest; derivatives of these are not available
  std::vector<double> breaks;         ///< ascending: times at which samples jump or bend
};

/// Reads the option `inputs` of init and integrate. A Lua function is called once with the symbol
/// t; if that gives an expression, derivatives are exact. The callbacks keep a reference to the
/// function; they must not outlive L. Throws Error on what is no input of the model (did you
/// mean), wrong sizes, results that are not numbers.
Inputs read_inputs(const Options& options, const dae::Model& model, lua_State* L);

/// Parameter overrides: params = { m = 2 }. others: names that may be given besides
/// the parameters of the model.
dae::ParameterValues read_parameters(lua_State* L, int index, const dae::Model& model,
                                     const std::string& what, std::span<const Expr> others = {});
/// Parameters in the tables `inputs` and `events` at these indices, which the model need not contain.
std::vector<Expr> parameters_beside(lua_State* L, int inputs, int events);

}  // namespace pendula::lua
