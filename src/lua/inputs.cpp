#include "lua/inputs.hpp"

#include <algorithm>
#include <cmath>

#include "expr/print.hpp"
#include "lua/function_reference.hpp"

namespace pendula::lua {
namespace {

/// f(t) with the symbol t, if the function can be followed symbolically: no branches on t, vocabulary
/// functions only.
std::optional<MatX> traced(lua_State* L, int function, const std::string& what) {
  lua_pushvalue(L, function);
  push_expr(L, time_symbol());
  try {
    protected_call(L, 1, 1);
  } catch (const LuaError&) {
    return {};
  }
  std::optional<MatX> result;
  if (is_expression(L, -1) || lua_istable(L, -1) || lua_isuserdata(L, -1)) result = to_matrix(L, -1, what);
  lua_pop(L, 1);
  return result;
}

std::function<double(double)> numeric(std::shared_ptr<FunctionReference> f, Eigen::Index row,
                                      std::string name) {
  return [f = std::move(f), row, name = std::move(name)](double t) {
    lua_State* L = f->state();
    f->push();
    lua_pushnumber(L, t);
    protected_call(L, 1, 1);
    const Vec value =
        lua_isnumber(L, -1) ? Vec::Constant(1, lua_tonumber(L, -1)) : to_numbers(L, -1, "input " + name);
    lua_pop(L, 1);
    if (row >= value.size() || !std::isfinite(value[row]))
      throw Error(text("input '", name, "' must give ",
                       row + 1 > 1 ? "a column of finite numbers" : "a finite number", " at t = ", t));
    return value[row];
  };
}

void give(const std::vector<Expr>& leaves_given, const MatX& value, const std::string& key,
          Substitution& out) {
  if (value.size() != static_cast<Eigen::Index>(leaves_given.size()))
    throw Error(
        text("input '", key, "' has ", leaves_given.size(), " components, its value has ", value.size()));
  for (std::size_t i = 0; i < leaves_given.size(); ++i) {
    const Expr e = value.data()[i];
    for (Expr leaf : leaves({&e, 1}))
      if (symbol_of(leaf).kind == Kind::variable)
        throw Error(text("input '", key, "' = ", to_text(e), " depends on the unknown '", to_text(leaf),
                         "'; write that as an equation of the model"));
    out[leaves_given[i]] = e;
  }
}

}  // namespace

Inputs read_inputs(const Options& options, const dae::Model& model, lua_State* L) {
  Inputs inputs;
  if (!options.has("inputs")) return inputs;
  const int table = options.push("inputs");
  std::vector<Expr> known = model.inputs;  // and their derivatives, for functions that cannot be traced
  for (Expr u : model.inputs)
    for (int k = 1; k <= 4; ++k) known.push_back(derivative_leaf(u, k));
  each_symbol_entry(L, table, "inputs", known, [&](const SymbolEntry& entry) {
    for (Expr leaf : entry.leaves)
      if (std::find(model.inputs.begin(), model.inputs.end(), symbol_of(leaf).base) == model.inputs.end())
        throw Error(text("'", entry.key, "' is not an input of this model"));
    if (!lua_isfunction(L, entry.value))
      return give(entry.leaves, to_matrix(L, entry.value, "input " + entry.key), entry.key,
                  inputs.expressions);
    if (const auto e = traced(L, entry.value, "input " + entry.key))
      return give(entry.leaves, *e, entry.key, inputs.expressions);
    const auto f = std::make_shared<FunctionReference>(L, entry.value);
    for (std::size_t i = 0; i < entry.leaves.size(); ++i)
      inputs.numeric.push_back({entry.leaves[i], numeric(f, static_cast<Eigen::Index>(i), entry.key)});
  });
  lua_pop(L, 1);
  // Reduction differentiates further than the model as written: every order that can occur is prepared.
  Substitution all = inputs.expressions;
  for (const auto& [leaf, value] : inputs.expressions)
    for (int k = 1; k <= 4; ++k)
      if (symbol_of(leaf).order == 0) all.try_emplace(derivative_leaf(leaf, k), total_derivative(value, k));
  inputs.expressions = std::move(all);
  return inputs;
}

dae::ParameterValues read_parameters(lua_State* L, int index, const dae::Model& model,
                                     const std::string& what) {
  dae::ParameterValues values;
  each_symbol_entry(L, index, what, model.parameters, [&](const SymbolEntry& entry) {
    const MatX value = to_matrix(L, entry.value, what + "." + entry.key);
    if (value.size() != static_cast<Eigen::Index>(entry.leaves.size()))
      throw Error(text(what, ": '", entry.key, "' has ", entry.leaves.size(), " components, its value has ",
                       value.size()));
    for (std::size_t i = 0; i < entry.leaves.size(); ++i) {
      const Expr e = value.data()[i];
      for (Expr leaf : leaves({&e, 1}))
        if (symbol_of(leaf).kind != Kind::constant)
          throw Error(text(what, ": '", entry.key, "' must be a number, got ", to_text(e)));
      values[entry.leaves[i]] = e;
    }
  });
  return values;
}

}  // namespace pendula::lua
