#include "lua/read/inputs.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "integrate/problem/samples.hpp"
#include "lua/core/function_reference.hpp"
#include "lua/core/objects.hpp"
#include "lua/read/iddata.hpp"

namespace pendula::lua {
namespace {

/// f(t) as an expression, if the function can be traced with the symbol t: no branches on t,
/// library functions only.
std::optional<MatX> traced(lua_State* L, int function, const std::string& what) {
  lua_pushvalue(L, function);
  push_expr(L, time_symbol());
  try {
    protected_call(L, 1, 1);
  } catch (const LuaError& e) {
    // an input that integrates itself would be attempted twice at every depth
    if (std::string_view(e.what()).find("stack overflow") != std::string_view::npos) throw;
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
    lua_State* L = f->push();
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

struct SampleTable {
  Vec t;
  Mat values;  ///< one row per time
  integrate::Samples::Hold hold = integrate::Samples::Hold::linear;
};

/// Field of the table at `index` as numbers; empty if absent.
Mat numbers_of(lua_State* L, int index, const char* field, const std::string& what) {
  lua_getfield(L, index, field);
  Mat result;
  if (!lua_isnil(L, -1)) result = to_numeric_matrix(L, lua_gettop(L), text(what, ".", field));
  lua_pop(L, 1);
  return result;
}

SampleTable sample_fields(lua_State* L, int index, const std::string& what) {
  refuse_callable(L, index, what);
  lua_pushnil(L);
  while (lua_next(L, index) != 0) {
    lua_pop(L, 1);
    static const std::vector<std::string> known = {"t", "u", "Ts", "hold"};
    const std::string key = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "[…]";
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw Error(
          text(what, ": unknown field '", key, "'.", did_you_mean(key, known),
               " Samples are { t = {…}, u = {…}, hold = \"linear\" or \"zero\" }; Ts = 0.1 may stand for t"));
  }
  SampleTable table;
  table.values = numbers_of(L, index, "u", what);
  if (table.values.size() == 0) throw Error(text(what, " has no values: u = {…}"));
  if (table.values.rows() == 1) table.values.transposeInPlace();
  const Mat t = numbers_of(L, index, "t", what), Ts = numbers_of(L, index, "Ts", what);
  if ((t.size() > 0) == (Ts.size() > 0))
    throw Error(text(what, " needs the times of its samples: either t = {…} or Ts = 0.1"));
  if (Ts.size() > 0 && !(Ts.size() == 1 && Ts(0, 0) > 0))
    throw Error(text(what, ".Ts must be a positive number"));
  table.t = t.size() > 0 ? Vec(t.reshaped())
                         : Vec(Vec::LinSpaced(table.values.rows(), 0, 1) *
                               (Ts(0, 0) * static_cast<double>(table.values.rows() - 1)));
  lua_getfield(L, index, "hold");
  const std::string hold = lua_isnil(L, -1) ? "linear" : lua_tostring(L, -1) ? lua_tostring(L, -1) : "";
  lua_pop(L, 1);
  if (hold != "linear" && hold != "zero")
    throw Error(text(what, ".hold: \"linear\" (straight lines) or \"zero\" (constant between samples)"));
  if (hold == "zero") table.hold = integrate::Samples::Hold::zero;
  return table;
}

/// Samples in any of their forms; empty for other values.
std::optional<SampleTable> samples(lua_State* L, int index, std::size_t components, const std::string& what) {
  if (const auto* held = object_at(L, index, TypeName<sysid::IdData>::value)) {
    const auto& d = *static_cast<const sysid::IdData*>(held->get());
    if (d.inputs() == 0) throw Error(text(what, ": the data has no input"));
    if (d.experiments() > 1) throw Error(text(what, ": the data has several experiments; take one of them"));
    SampleTable table{Vec::LinSpaced(d.samples(), 0, static_cast<double>(d.samples() - 1)) * d.Ts, d.u,
                      integrate::Samples::Hold::zero};
    return table;
  }
  if (lua_istable(L, index) && object_type(L, index).empty() && lua_rawlen(L, index) == 0) {
    lua_pushnil(L);
    if (lua_next(L, index) == 0) return {};
    lua_pop(L, 2);
    return sample_fields(L, index, what);
  }
  if (components != 1 || !(lua_istable(L, index) || object_at(L, index, TypeName<Matrix>::value))) return {};
  const MatX m = to_matrix(L, index, what);
  if (m.cols() != 2 || m.rows() < 2) {
    if (m.size() > 1)
      throw Error(text(what, " has ", m.size(),
                       " values for one component; samples need their times: { t = {…}, u = {…} }, ",
                       "{ Ts = 0.1, u = {…} }, or rows { {t, u}, … }"));
    return {};
  }
  const Mat rows = to_numeric_matrix(L, index, what);
  return SampleTable{rows.col(0), rows.col(1)};
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
                         "'; that is an equation, which closes the loop: dae{ model, ", key, " ~ ",
                         to_text(e), " }"));
    out[leaves_given[i]] = e;
  }
}

void give_samples(const SymbolEntry& entry, const SampleTable& table, Inputs& out) {
  if (table.values.cols() != static_cast<Eigen::Index>(entry.leaves.size()))
    throw Error(text("input '", entry.key(), "' has ", entry.leaves.size(), " components, its samples have ",
                     table.values.cols()));
  const std::vector<double> t(table.t.begin(), table.t.end());
  for (std::size_t i = 0; i < entry.leaves.size(); ++i) {
    const Vec column = table.values.col(static_cast<Eigen::Index>(i));
    const auto signal = std::make_shared<integrate::Samples>(
        t, std::vector<double>(column.begin(), column.end()), table.hold, entry.key());
    out.numeric.push_back({entry.leaves[i], [signal](double at) { return (*signal)(at); }, false});
    if (table.hold == integrate::Samples::Hold::linear)
      out.numeric.push_back(
          {derivative_leaf(entry.leaves[i]), [signal](double at) { return signal->slope(at); }, false});
  }
  out.breaks.insert(out.breaks.end(), t.begin(), t.end());
  std::sort(out.breaks.begin(), out.breaks.end());
}

}  // namespace

Inputs read_inputs(const Options& options, const dae::Model& model, lua_State* L) {
  Inputs inputs;
  if (!options.has("inputs")) return inputs;
  const int table = options.push("inputs");
  std::vector<Expr> known = model.inputs;  // with their derivatives, for functions that cannot be traced
  for (Expr u : model.inputs)
    for (int k = 1; k <= 4; ++k) known.push_back(derivative_leaf(u, k));
  each_symbol_entry(L, table, "inputs", known, [&](const SymbolEntry& entry) {
    for (Expr leaf : entry.leaves)
      if (std::find(model.inputs.begin(), model.inputs.end(), symbol_of(leaf).base) == model.inputs.end())
        throw Error(text("'", entry.key(), "' is not an input of this model"));
    if (const auto data = samples(L, entry.value, entry.leaves.size(), "input " + entry.key()))
      return give_samples(entry, *data, inputs);
    if (!lua_isfunction(L, entry.value))
      return give(entry.leaves, to_matrix(L, entry.value, "input " + entry.key()), entry.key(),
                  inputs.expressions);
    if (const auto e = traced(L, entry.value, "input " + entry.key()))
      return give(entry.leaves, *e, entry.key(), inputs.expressions);
    const auto f = std::make_shared<FunctionReference>(L, entry.value);
    for (std::size_t i = 0; i < entry.leaves.size(); ++i)
      inputs.numeric.push_back({entry.leaves[i], numeric(f, static_cast<Eigen::Index>(i), entry.key())});
  });
  lua_pop(L, 1);
  // Reduction differentiates the model further; every order that can occur is prepared.
  Substitution all = inputs.expressions;
  for (const auto& [leaf, value] : inputs.expressions)
    for (int k = 1; k <= 4; ++k)
      if (symbol_of(leaf).order == 0) all.try_emplace(derivative_leaf(leaf, k), total_derivative(value, k));
  inputs.expressions = std::move(all);
  return inputs;
}

/// Adds the parameters in the expressions of a value, of the entries of a table, and of the results of
/// functions that can be traced.
static void add_parameters(lua_State* L, int index, bool trace, std::vector<Expr>& found, int depth = 0) {
  constexpr int deepest = 4;  // events: list, event, reset, column; limits tables that contain themselves
  const auto add = [&](const MatX& m) {
    for (Expr leaf : leaves({m.data(), static_cast<std::size_t>(m.size())}))
      if (symbol_of(leaf).kind == Kind::parameter &&
          std::find(found.begin(), found.end(), leaf) == found.end())
        found.push_back(leaf);
  };
  const std::string type = object_type(L, index);
  if (type == TypeName<Expr>::value || type == TypeName<Matrix>::value)
    return add(to_matrix(L, index, "params"));
  if (trace && lua_isfunction(L, index)) {
    if (const auto e = traced(L, index, "params")) add(*e);
    return;
  }
  if (!lua_istable(L, index) || !type.empty() || depth == deepest) return;
  for (lua_pushnil(L); lua_next(L, index) != 0; lua_pop(L, 1))
    add_parameters(L, lua_gettop(L), trace, found, depth + 1);
}

std::vector<Expr> parameters_beside(lua_State* L, int inputs, int events) {
  std::vector<Expr> found;
  add_parameters(L, inputs, true, found);
  add_parameters(L, events, false, found);
  return found;
}

dae::ParameterValues read_parameters(lua_State* L, int index, const dae::Model& model,
                                     const std::string& what, std::span<const Expr> others) {
  dae::ParameterValues values;
  std::vector<Expr> known = model.parameters;
  for (Expr p : others)
    if (std::find(known.begin(), known.end(), p) == known.end()) known.push_back(p);
  each_known_entry(L, index, what, known, [&](const SymbolEntry& entry) {
    const bool plain = lua_type(L, entry.value) == LUA_TNUMBER && std::isfinite(lua_tonumber(L, entry.value));
    const MatX value = to_matrix(L, entry.value, plain ? what : what + "." + entry.key());
    if (value.size() != static_cast<Eigen::Index>(entry.leaves.size()))
      throw Error(text(what, ": '", entry.key(), "' has ", entry.leaves.size(), " components, its value has ",
                       value.size()));
    for (std::size_t i = 0; i < entry.leaves.size(); ++i) {
      const Expr e = value.data()[i];
      if (e.is_constant()) {
        values[entry.leaves[i]] = e;
        continue;
      }
      for (Expr leaf : leaves({&e, 1}))
        if (symbol_of(leaf).kind != Kind::constant)
          throw Error(text(what, ": '", entry.key(), "' must be a number, got ", to_text(e)));
      values[entry.leaves[i]] = e;
    }
  });
  return values;
}

}  // namespace pendula::lua
