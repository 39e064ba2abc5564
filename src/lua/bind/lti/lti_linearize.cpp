// sys:linearize(at). Reads arguments, calls src/lti.
#include <algorithm>

#include "base/text.hpp"
#include "lti/linearize.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/screen/pager.hpp"

namespace pendula::lua {
namespace {

/// Rejects inputs = { F = 0 }: values belong to the point, and inputs = { F } selects the inputs of G.
void refuse_values_as_inputs(lua_State* L, int index) {
  if (!lua_istable(L, index)) return;
  lua_pushnil(L);
  while (lua_next(L, index) != 0) {
    lua_pop(L, 1);
    const Expr* symbol = object<Expr>(L, -1);
    if (lua_type(L, -1) != LUA_TSTRING && !symbol) continue;
    const std::string name = symbol ? leaf_name(*symbol) : lua_tostring(L, -1);
    throw Error(text("inputs = { ", name,
                     " = … } gives a value, which belongs to the point: sys:linearize{ …, ", name,
                     " = 0 }; inputs = { \"", name, "\" } in a second table says which inputs G has"));
  }
}

/// Rejects options among the values of a point, which is the first argument.
void refuse_options_in_point(lua_State* L, int point, const dae::Model& model) {
  std::vector<std::string> known;
  for (Expr v : model.states()) known.push_back(symbol_of(v).name);
  for (Expr u : model.inputs) known.push_back(symbol_of(u).name);
  for (const char* key : {"inputs", "outputs", "params", "from", "guess", "start", "fix"}) {
    const bool there = lua_getfield(L, point, key) != LUA_TNIL;
    lua_pop(L, 1);
    if (!there || std::find(known.begin(), known.end(), key) != known.end()) continue;
    if (key == std::string("start") || key == std::string("fix"))
      throw Error(text("the point itself is the first argument; write sys:linearize{ ", known[0],
                       " = 0, … } or sys:linearize(sys:init{ ", key, " = … })"));
    if (key == std::string("inputs")) {
      lua_getfield(L, point, key);
      refuse_values_as_inputs(L, lua_gettop(L));
      lua_pop(L, 1);
    }
    throw Error(text("'", key, "' belongs into a second table: sys:linearize({ ",
                     known.empty() ? "…" : known[0] + " = 0, …", " }, { ", key, " = … })"));
  }
}

/// Splits a point { theta = 0, F = 0 } into its states and its inputs: the tables `start` and `inputs`
/// of the options.
void split_point(lua_State* L, int point, int options, const dae::Model& model) {
  lua_newtable(L);
  const int start = lua_gettop(L);
  lua_newtable(L);
  const int inputs = start + 1;
  std::vector<Expr> missing = model.inputs;
  lua_pushnil(L);
  while (lua_next(L, point) != 0) {
    const auto named = std::erase_if(missing, [&](Expr u) {
      const Expr* symbol = object<Expr>(L, -2);
      return symbol ? *symbol == u : lua_type(L, -2) == LUA_TSTRING && leaf_name(u) == lua_tostring(L, -2);
    });
    lua_pushvalue(L, -2);
    lua_insert(L, -2);
    lua_rawset(L, named > 0 ? inputs : start);
  }
  if (!model.inputs.empty()) lua_setfield(L, options, "inputs");
  lua_settop(L, start);
  lua_setfield(L, options, "start");
  if (missing.empty()) return;
  std::vector<std::string> names, values;
  for (Expr u : missing) {
    names.push_back("'" + leaf_name(u) + "'");
    values.push_back(leaf_name(u) + " = 0");
  }
  throw Error(text("the point gives no value of the input", names.size() > 1 ? "s " : " ", join(names, ", "),
                   "; write sys:linearize{ …, ", join(values, ", "), " }"));
}

/// The conditions of a point as read_start reads them.
const OptionTable point_options = {
    {"start", "start or table", "", "a result of init, or values", "@variables"},
    {"params", "table", "", "values of parameters: { m = 2 }", "@parameters"},
    {"from", "number", "0", "the time of the point, in s"},
    {"guess", "table", "", "where the search for values that are not given begins", "@variables"},
    {"fix", "table", "", "values that are given", "@variables"},
    {"inputs", "table", "", "values of the inputs", "@inputs"},
};

/// A start of this model or a relative of it, or a table of conditions that init completes.
dae::ConsistentStatePtr read_point(Call& call, const dae::ModelPtr& model) {
  if (!call.has(2)) call.wrong(2, "at", "a start: sys:linearize(sys:init{ … })");
  lua_State* L = call.L;
  lua_createtable(L, 0, 4);
  const int table = lua_gettop(L);
  if (lua_istable(L, 2)) {
    refuse_options_in_point(L, 2, *model);
    split_point(L, 2, table, *model);
  } else {
    lua_pushvalue(L, 2);
    lua_setfield(L, table, "start");
  }
  if (lua_istable(L, 3))
    for (const char* key : {"params", "from", "guess"}) {
      lua_getfield(L, 3, key);
      lua_setfield(L, table, key);
    }
  lua_replace(L, 2);
  return read_start(L, call.options(2, point_options), model);
}

std::vector<Expr> read_inputs_of(lua_State* L, int index, const dae::Model& model) {
  std::vector<Expr> known = model.inputs;
  known.insert(known.end(), model.parameters.begin(), model.parameters.end());
  return to_leaves(L, index, "inputs", known);
}

int linearize(Call& call) {
  const auto model = call.shared<dae::Model>(1, "model");
  lua_State* L = call.L;
  lti::LinearizeRequest request;
  if (call.has(3)) {
    const Options o = call.options(3);
    if (o.has("inputs")) {
      const int at = o.push("inputs");
      refuse_values_as_inputs(L, at);
      request.inputs = read_inputs_of(L, at, *model);
    }
    if (o.has("outputs")) {
      const int at = o.push("outputs");
      const VecX list = is_expression(L, at) ? VecX(VecX::Constant(1, to_expr(L, at, "outputs")))
                                             : to_column(L, at, "outputs");
      request.outputs.assign(list.data(), list.data() + list.size());
    }
    lua_settop(L, call.count());
  }
  const dae::ConsistentStatePtr at = read_point(call, model);
  collect_aliases(L);
  lti::System g = lti::linearize(at->model, *at, request);
  for (const std::string& note : g.notes)
    if (note.starts_with("no equilibrium")) warn("linearize: " + note);
  return push_system(call, std::move(g));
}

const OptionTable linearize_options = {
    {"inputs", "string or list", "", "inputs or parameters of the model; without it its inputs"},
    {"outputs", "expression or list", "", "any expressions of the model; without it the states"},
    {"params", "table", "", "values of parameters: { m = 2 }", "@parameters"},
    {"from", "number", "0", "the time of the point, in s"},
    {"guess", "table", "", "where the search for values that are not given begins", "@variables"},
};

}  // namespace

extern const Module lti_linearize_module = {
    "linearize",
    "Linear systems from models",
    {
        {"model:linearize", linearize, "sys:linearize(at [, { inputs =, outputs = }]) -> G",
         R"(The state space of small deviations from a start, or from a point { theta = 0, F = 0 } of states
            and inputs, with its states by name. A model of higher index is linearised at an equilibrium, with as many
            states as degrees of freedom, or elsewhere along the tangent of its constraints. inputs: inputs or parameters;
            outputs: any expressions, multipliers and accelerations included; without them the states. A
            point that is no equilibrium gives a warning. (To linearise a model.))",
         "th = var \"theta\"  sys = dae{ der(th, 2) ~ -4*sin(th) }  return sys:linearize(sys:init{ fix = { "
         "[th] = 0, [th.dot] = 0 } }):poles()",
         "poles: ±2 i", &linearize_options},
    }};

}  // namespace pendula::lua
