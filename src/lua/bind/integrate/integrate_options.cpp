#include "lua/bind/integrate/integrate_options.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "dae/start/continuations.hpp"
#include "expr/print/print.hpp"
#include "integrate/run/methods.hpp"
#include "lua/bind/dae/transitions.hpp"
#include "lua/bind/integrate/tableau.hpp"
#include "lua/core/foreign_names.hpp"
#include "lua/core/function_reference.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"
#include "lua/read/inputs.hpp"

namespace pendula::lua {

const OptionTable& integrate_option_rows() {
  static const OptionTable rows = {
      {"start", "start or table", "",
       "where it begins: a result of init or sol:state(), or { x = 1, [x.dot] = 0 }", "@variables"},
      {"from", "number", "0", "the time of the start, in s; in sweep also a fit, whose estimates are drawn"},
      {"to", "number", "", "the end of the interval, in s; required unless times says it"},
      {"times", "list of numbers", "", "the times at which points are saved; without it every step"},
      {"method", "string or tableau", "\"auto\"",
       "by name, or any tableau or bdf(k); sol:stats() names the choice", "@methods"},
      {"dt", "number", "", "fixed steps of this length, in s, for any tableau; instead of rtol and atol"},
      {"rtol", "number, list or table", "1e-6",
       "relative tolerance of each step; also a list or { [x] = 1e-9 }"},
      {"atol", "number, list or table", "1e-3*rtol",
       "absolute tolerance of each step, in units of the variables; also a list or table"},
      {"inputs", "table", "",
       "{ [u] = … }: a Lua function of t, an expression, iddata, or samples { t =, u =, hold = }", "@inputs"},
      {"params", "table", "", "values of parameters for this run: { m = 2 }", "@parameters"},
      {"events", "list of tables", "",
       "{ when = e, direction = -1, 0 or 1, action = \"stop\", reset = { [v] = … } or call = function(sol) … end }"},
      {"branch", "string or table", "",
       "where branches of solutions meet: \"smooth\" goes on smoothly, { [z.dot] = 1 } with the derivative nearest to "
       "that; without it the run stops there",
       "@variables"},
      {"sensitivities", "list of symbols", "", "parameters, and states that stand for their initial values",
       "@parameters"},
      {"dt0", "number", "", "length of the first step, in s"},
      {"dtmax", "number", "", "length of the longest step, in s"},
      {"max_steps", "integer", "", "the run stops after this many steps"},
      {"direct", "boolean", "false",
       "integrate a model of index 2 or more as it stands, to study order reduction"},
      {"guards", "boolean", "true",
       "end the run where constraints become dependent or an equation loses its unknown"},
  };
  return rows;
}
namespace {

using integrate::Method;
using integrate::ModelEvent;
using integrate::TableauPtr;

template <class T>
std::shared_ptr<const T> held_at(lua_State* L, int index) {
  const auto* held = object_at(L, index, TypeName<T>::value);
  return held ? std::static_pointer_cast<const T>(*held) : nullptr;
}

int get_field(lua_State* L) {
  lua_gettable(L, 1);
  return 1;
}

/// table.name as a T, or null. Uses __index of the table, since methods are created on first access.
template <class T>
std::shared_ptr<const T> library_method(lua_State* L, const std::string& table, const std::string& name) {
  const int top = lua_gettop(L);
  std::shared_ptr<const T> result;
  try {
    lua_pushcfunction(L, get_field);
    push_named(L, table);
    lua_pushlstring(L, name.data(), name.size());
    protected_call(L, 2, 1);
    result = held_at<T>(L, -1);
  } catch (const LuaError&) {  // no such name
  }
  lua_settop(L, top);
  return result;
}

TableauPtr library_tableau(lua_State* L, const std::string& name) {
  return library_method<integrate::Tableau>(L, "rk", name);
}

/// The names that a user can give, for messages.
std::vector<std::string> known_methods() {
  std::vector<std::string> known{"auto"};
  for (const integrate::MethodFamily* family : integrate::families())
    if (family->listed) known.emplace_back(family->name);
  for (const char* name : {"dopri5", "tsit5", "dop853", "rk4", "bogacki_shampine"}) known.emplace_back(name);
  return known;
}

Method named_method(lua_State* L, const std::string& wanted, bool fixed) {
  if (wanted == "auto") return automatic_method(L);
  const integrate::MethodFamily* family = integrate::family_named(wanted);
  const bool complete = family && family->listed && family->default_method.empty();
  if (!fixed && complete) {
    Method method;
    method.family = family;
    return method;
  }
  if (TableauPtr tableau = library_tableau(L, wanted)) return integrate::method_of(std::move(tableau));
  if (!fixed) {
    const std::string name(family && !family->default_method.empty() ? family->default_method : wanted);
    if (auto rosenbrock = library_method<integrate::Rosenbrock>(L, "rosenbrock", name))
      return integrate::method_of(std::move(rosenbrock));
  }
  if (!family || !family->listed) {
    const std::vector<std::string> known = known_methods();
    if (const std::string like = method_like(wanted); !like.empty())
      throw Error(text("unknown method '", wanted, "'; the nearest method here is method = \"", like, "\""));
    throw Error(text("unknown method '", wanted, "'.", did_you_mean(wanted, known),
                     " Give a tableau, for example method = rk.gauss(2), or one of ", join(known, ", ")));
  }
  if (fixed)
    throw Error(text("method = \"", wanted,
                     "\" chooses its steps; for fixed steps give a tableau, for example ", family->instead,
                     ", or leave dt out and give rtol = 1e-6"));
  Method method;
  method.family = family;
  return method;
}

/// atol alone may be 0. place: "atol", "atol[2]" or "atol: that of x"; remedy: "atol = 1e-8".
void check_tolerance(const std::string& place, double value, const std::string& remedy) {
  if (std::isfinite(value) && (value > 0 || (value == 0 && place.starts_with("atol")))) return;
  throw Error(text(place, " = ", std::isnan(value) ? "nan" : rounded(value),
                   "; a tolerance must be a positive number, for example ", remedy));
}

/// rtol = 1e-8, { [x] = 1e-8 } or { 1e-8, 1e-6 }.
integrate::ToleranceRequest read_tolerance(Call& call, const Options& options, const char* key,
                                           const dae::Model& model) {
  integrate::ToleranceRequest request;
  if (!options.has(key)) return request;
  lua_State* L = call.L;
  const int index = options.push(key);
  if (!lua_istable(L, index) || object_type(L, index) != "") {
    request.all = to_number(L, index, key);
    check_tolerance(key, *request.all, text(key, " = 1e-8"));
  } else if (lua_rawlen(L, index) > 0) {
    const Vec list = to_numbers(L, index, key);
    for (Eigen::Index i = 0; i < list.size(); ++i)
      check_tolerance(text(key, "[", i + 1, "]"), list[i], text(key, " = { 1e-8, 1e-6 }"));
    request.list.assign(list.begin(), list.end());
  } else {
    each_symbol_entry(L, index, key, known_leaves(model), [&](const SymbolEntry& entry) {
      const Vec value =
          lua_isnumber(L, entry.value)
              ? Vec::Constant(static_cast<Eigen::Index>(entry.leaves.size()), lua_tonumber(L, entry.value))
              : to_numbers(L, entry.value, std::string(key) + "." + entry.key());
      if (value.size() != static_cast<Eigen::Index>(entry.leaves.size()))
        throw Error(text(key, ": '", entry.key(), "' has ", entry.leaves.size(),
                         " components, its value has ", value.size()));
      for (std::size_t i = 0; i < entry.leaves.size(); ++i) {
        const std::string name = leaf_name(entry.leaves[i]);
        check_tolerance(text(key, ": that of ", name), value[i], text(key, " = { [", name, "] = 1e-8 }"));
        request.some.emplace_back(entry.leaves[i], value[i]);
      }
    });
  }
  lua_settop(L, call.count());
  return request;
}

// ── events ──

/// Reads the result of a callback: nothing, "stop" or true, or a table of new values.
integrate::EventReply read_reply(lua_State* L, const dae::Model& model, const std::string& what) {
  integrate::EventReply reply;
  const int index = lua_gettop(L);
  if (lua_isnoneornil(L, index)) return reply;
  if (lua_isboolean(L, index)) {
    reply.stop = lua_toboolean(L, index) != 0;
  } else if (lua_type(L, index) == LUA_TSTRING) {
    if (std::string(lua_tostring(L, index)) != "stop")
      throw Error(text(what, " returned \"", lua_tostring(L, index), "\"; it may return \"stop\""));
    reply.stop = true;
  } else if (lua_istable(L, index)) {
    for (const auto& [leaf, value] : read_reset(L, index, known_leaves(model), what)) {
      const auto number = number_value(value);
      if (!number)
        throw Error(
            text(what, " must return numbers, but the new value of ", to_text(leaf), " is ", to_text(value)));
      reply.reset.emplace_back(leaf, *number);
    }
  } else {
    throw Error(
        text(what, " must return nothing, \"stop\" or new values { [v] = 1 }, got ", describe(L, index)));
  }
  return reply;
}

ModelEvent read_event(lua_State* L, int table, const dae::ModelPtr& model, const std::string& what) {
  ModelEvent event;
  static_cast<dae::Transition&>(event) = read_transition(L, table, known_leaves(*model), what);
  const int top = lua_gettop(L);
  lua_pushliteral(L, "call");
  lua_rawget(L, table);
  if (const int call = lua_gettop(L); !lua_isnil(L, call)) {
    if (!lua_isfunction(L, call))
      throw Error(text(what, ".call must be a function, got ", describe(L, call)));
    event.call = [f = std::make_shared<FunctionReference>(L, call), model,
                  what](const integrate::TrajectoryPtr& so_far) {
      lua_State* state = f->push();
      const int level = lua_gettop(state) - 1;
      push_object(state, so_far, TypeName<integrate::Trajectory>::value);
      protected_call(state, 1, 1);
      const integrate::EventReply reply = read_reply(state, *model, what + ".call");
      lua_settop(state, level);
      return reply;
    };
  }
  lua_settop(L, top);
  return event;
}

std::vector<ModelEvent> read_events(Call& call, const Options& options, const dae::ModelPtr& model) {
  std::vector<ModelEvent> events;
  if (!options.has("events")) return events;
  lua_State* L = call.L;
  const int list = options.push("events");
  if (!lua_istable(L, list))
    throw Error("events must be a list of tables { { when = y, action = \"stop\" } }");
  lua_getfield(L, list, "when");
  const bool single = !lua_isnil(L, -1);
  lua_pop(L, 1);
  if (single) {
    events.push_back(read_event(L, list, model, "events"));
  } else {
    const lua_Integer count = list_size(L, list, "events");
    for (lua_Integer i = 1; i <= count; ++i) {
      lua_geti(L, list, i);
      events.push_back(read_event(L, lua_gettop(L), model, text("events[", i, "]")));
      lua_pop(L, 1);
    }
  }
  lua_settop(L, call.count());
  return events;
}

// ── branches ──

std::optional<integrate::BranchChoice> read_branch(Call& call, const Options& options,
                                                   const dae::Model& model) {
  if (!options.has("branch")) return {};
  constexpr int highest = 3;
  integrate::BranchChoice choice;
  const int index = options.push("branch");
  if (lua_type(call.L, index) == LUA_TSTRING) {
    if (const std::string word = lua_tostring(call.L, index); word != "smooth")
      throw Error(text(
          "branch = \"", word,
          "\": write branch = \"smooth\", or the derivative that chooses: branch = ", "{ [z.dot] = 1 }"));
  } else if (lua_istable(call.L, index) && object_type(call.L, index).empty()) {
    std::vector<Expr> known = known_leaves(model);
    for (const dae::Model* m = &model; m; m = m->parent.get())
      for (const auto& v : m->variables)
        for (int k = 1; k <= std::max(v.order, 1) + highest; ++k)
          if (const Expr leaf = derivative_leaf(v.leaf, k);
              std::find(known.begin(), known.end(), leaf) == known.end())
            known.push_back(leaf);
    choice.derivatives = to_symbol_numbers(call.L, index, "branch", known);
    for (const auto& [leaf, value] : choice.derivatives)
      if (const std::string why = dae::cannot_choose(model, leaf, value); !why.empty()) throw Error(why);
    if (choice.derivatives.empty())
      throw Error("branch is empty: write branch = \"smooth\" or branch = { [z.dot] = 1 }");
  } else {
    throw Error(text("branch must be \"smooth\" or a table { [z.dot] = 1 }, got ", describe(call.L, index)));
  }
  lua_settop(call.L, call.count());
  return choice;
}

// ── the rest ──

void refuse_contradictions(const Options& options) {
  if (!options.has("dt")) return;
  for (const char* other : {"rtol", "atol", "dt0", "dtmax"})
    if (options.has(other))
      throw Error(
          text("dt asks for fixed steps and ", other,
               " for steps chosen by the error: give one of them (dt0 is the first of chosen steps)"));
}

integrate::Plan read_plan(Call& call, const Options& options, double from) {
  if (!options.has("to") && !options.has("times")) throw Error("the end is missing; give to = 10");
  integrate::Plan plan;
  plan.from = options.number("from", from);
  if (options.has("dt")) {
    plan.dt = options.number("dt");
    if (!(*plan.dt > 0) || !std::isfinite(*plan.dt))
      throw Error(
          text("dt = ", rounded(*plan.dt), "; the step must be a positive number, for example dt = 0.01"));
  }
  plan.direct = options.boolean("direct", false);
  plan.check_singularities = options.boolean("guards", true);
  plan.dt_first = options.number("dt0", 0);
  if (options.has("dt0") && !(plan.dt_first > 0))
    throw Error("dt0 must be a positive number: the first step");
  plan.dt_max = options.number("dtmax", plan.dt_max);
  plan.most_steps = options.integer("max_steps", plan.most_steps);
  if (options.has("times")) {
    const Vec times = to_numbers(call.L, options.push("times"), "times");
    plan.times = std::vector<double>(times.begin(), times.end());
    lua_pop(call.L, 1);
  }
  // without `to` the last of `times` is the end; integrate() itself rejects an empty list
  const bool last = plan.times && !plan.times->empty();
  plan.to = options.number("to", last ? plan.times->back() : plan.from + 1);
  return plan;
}

/// Parameter values: params of this call take precedence over those with which a start was computed.
dae::ParameterValues read_all_parameters(Call& call, const Options& options, const dae::Model& model) {
  dae::ParameterValues values;
  if (const auto* held =
          object_at(call.L, push_start(call.L, options), TypeName<dae::ConsistentState>::value)) {
    values = parameter_overrides(*std::static_pointer_cast<const dae::ConsistentState>(*held));
  }
  if (options.has("params")) {
    const int inputs = options.push("inputs"), events = options.push("events");
    const auto others = parameters_beside(call.L, inputs, events);
    for (const auto& [p, value] : read_parameters(call.L, options.push("params"), model, "params", others))
      values[p] = value;
  }
  lua_settop(call.L, call.count());
  return values;
}

}  // namespace

/// The methods for automatic choice. Creating a tableau costs half a millisecond, so only candidates are
/// created. Among Rosenbrock methods small models use the one with the longest steps, large ones the one with
/// the fewest solutions per step.
Method automatic_method(lua_State* L, std::optional<double> rtol, std::size_t equations) {
  constexpr std::size_t large = 60;  // from here on with a dense Jacobian: choose()
  const char* names[] = {"verner87", "verner98", "dop853"};
  Method method;
  for (std::size_t k = 0; k < std::size(names); ++k) {
    const bool wanted = !rtol || integrate::explicit_choice_at(*rtol) == k || (k == 2 && equations >= large);
    TableauPtr tableau = wanted ? library_tableau(L, names[k]) : nullptr;
    if (wanted && !tableau) tableau = library_tableau(L, "dopri5");
    method.explicit_choice.push_back(tableau);
  }
  constexpr double loose = 0.9e-5;  // 1e-5 and looser, as methods.cpp chooses
  if (!rtol || *rtol > loose)
    method.rosenbrock =
        library_method<integrate::Rosenbrock>(L, "rosenbrock", equations <= large ? "rodas5p" : "rodas4");
  return method;
}

/// The smallest of the relative tolerances.
static double tightest(Call& call, const Options& options, const dae::Model& model) {
  const integrate::ToleranceRequest rtol = read_tolerance(call, options, "rtol", model);
  double least = rtol.all.value_or(1e-6);
  for (double r : rtol.list) least = std::min(least, r);
  for (const auto& [leaf, r] : rtol.some) least = std::min(least, r);
  return least;
}

Method read_method(Call& call, const Options& options, bool fixed, const dae::Model* model) {
  lua_State* L = call.L;
  if (!options.has("method")) {
    if (fixed)
      throw Error(
          "method is missing; give a tableau, for example method = rk.gauss(2) or rk.rk4, or leave dt "
          "out: the method and its steps are then chosen");
    if (!model) return automatic_method(L);
    return automatic_method(L, tightest(call, options, *model), model->residuals.size());
  }
  const int index = options.push("method");
  Method method;
  if (lua_type(L, index) == LUA_TSTRING) {
    method = named_method(L, lua_tostring(L, index), fixed);
  } else if (const TableauPtr tableau = held_at<integrate::Tableau>(L, index)) {
    method = integrate::method_of(tableau);
  } else if (const auto rosenbrock = held_at<integrate::Rosenbrock>(L, index)) {
    if (fixed)
      throw Error(
          text("the method ", rosenbrock->name(),
               " chooses its steps: leave dt out and give rtol = 1e-6, to converge rtol = { 1e-4, 1e-6 }; "
               "a method with fixed steps is ",
               integrate::family::rosenbrock.instead));
    method = integrate::method_of(rosenbrock);
  } else if (const auto multistep = held_at<integrate::Multistep>(L, index)) {
    method.family = &integrate::family::bdf;
    method.multistep = multistep;
    method.order = multistep->steps();
    if (!multistep->is_bdf())
      throw Error(text("integration with the method ", multistep->name(),
                       " is not available; take bdf(3) or a tableau"));
  } else {
    throw Error(
        text("method must be a tableau such as rk.gauss(2) or rk.rk4, or a name such as \"radau\", got ",
             describe(L, index)));
  }
  lua_settop(L, call.count());
  return method;
}

integrate::Simulation read_simulation(Call& call, const Options& options, const dae::ModelPtr& asked) {
  integrate::Simulation simulation;
  refuse_contradictions(options);
  simulation.method = read_method(call, options, options.has("dt"), asked.get());
  simulation.start = read_start(call.L, options, asked);
  const dae::ModelPtr& model = simulation.start->model;
  simulation.plan = read_plan(call, options, simulation.start->t);
  simulation.parameters = read_all_parameters(call, options, *model);
  simulation.rtol = read_tolerance(call, options, "rtol", *model);
  simulation.atol = read_tolerance(call, options, "atol", *model);
  for (const dae::Transition& own : model->events) simulation.events.push_back({own, {}});
  for (ModelEvent& asked : read_events(call, options, model)) simulation.events.push_back(std::move(asked));
  if (simulation.plan.dt && !simulation.events.empty())
    throw Error("events need steps chosen by the error: leave dt out and give rtol = 1e-8");
  simulation.branch = read_branch(call, options, *model);
  if (options.has("sensitivities")) {
    std::vector<Expr> known = known_leaves(*model);
    known.insert(known.end(), model->parameters.begin(), model->parameters.end());
    const int inputs = options.push("inputs"), events = options.push("events");
    for (Expr p : parameters_beside(call.L, inputs, events))
      if (std::find(known.begin(), known.end(), p) == known.end()) known.push_back(p);
    simulation.sensitivities = to_leaves(call.L, options.push("sensitivities"), "sensitivities", known);
    lua_settop(call.L, call.count());
  }
  Inputs inputs = read_inputs(options, *model, call.L);
  simulation.inputs = std::move(inputs.expressions);
  simulation.plan.breaks = std::move(inputs.breaks);
  for (const NumericInput& input : inputs.numeric)
    if (input.may_jump) simulation.plan.monitored_inputs.push_back(input.value);
  for (NumericInput& input : inputs.numeric)
    simulation.numeric_inputs.emplace_back(input.leaf, std::move(input.value));
  return simulation;
}

}  // namespace pendula::lua
