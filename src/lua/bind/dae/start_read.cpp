// Start values, guesses and starts from Lua, and starts of other models.
#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/lru_cache.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/start/start.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/read/inputs.hpp"
#include "lua/screen/pager.hpp"

namespace pendula::lua {

/// The leaf named by a key of a table, if it is one of these.
static std::optional<Expr> leaf_of_key(lua_State* L, int key, const std::vector<Expr>& leaves) {
  const Expr* symbol = object<Expr>(L, key);
  const bool named = lua_type(L, key) == LUA_TSTRING;
  for (Expr leaf : leaves)
    if ((symbol && *symbol == leaf) || (named && symbol_of(leaf).name == lua_tostring(L, key))) return leaf;
  return std::nullopt;
}

/// Rejects inputs and parameters, which have tables of their own.
static void refuse_known(lua_State* L, int table, const std::string& what, const dae::Model& model) {
  const std::vector<Expr> variables = known_leaves(model);
  table = lua_absindex(L, table);
  lua_pushnil(L);
  while (lua_next(L, table) != 0) {
    lua_pop(L, 1);
    if (leaf_of_key(L, lua_gettop(L), variables)) continue;
    for (const auto& [leaves, kind, option] : {std::tuple{&model.inputs, "an input", "inputs"},
                                               std::tuple{&model.parameters, "a parameter", "params"}})
      if (const auto leaf = leaf_of_key(L, lua_gettop(L), *leaves))
        throw Error(text(what, ": '", to_text(*leaf), "' is ", kind, " of the model; its value goes into ",
                         option, " = { ", leaf_name(*leaf), " = … }"));
  }
}

/// Rejects keys that are expressions: a condition between unknowns needs an unknown of its own.
static void refuse_expressions(lua_State* L, int table, const std::string& what) {
  table = lua_absindex(L, table);
  lua_pushnil(L);
  while (lua_next(L, table) != 0) {
    lua_pop(L, 1);
    const Expr* key = object<Expr>(L, lua_gettop(L));
    if (!key || key->is_symbol()) continue;
    const std::string e = to_text(*key);
    throw Error(text("a key of ", what, " must be a symbol, not the expression ", e,
                     "; give it a name, an unknown d = var \"d\" with the equation d ~ ", e,
                     " in the model, and write ", what, " = { d = … }"));
  }
}

/// Rejects symbols that are no unknowns, or derivatives of one, of the model or of one it was made from.
static void refuse_foreign(const dae::LeafValues& given, const std::string& what,
                           const std::vector<Expr>& known) {
  const auto unknown_of = [](Expr leaf) {
    const Symbol& s = symbol_of(leaf);
    return s.order > 0 ? s.base : leaf;
  };
  std::unordered_set<Expr> unknowns;
  for (Expr leaf : known) unknowns.insert(unknown_of(leaf));
  for (const auto& [leaf, value] : given) {
    if (unknowns.count(unknown_of(leaf))) continue;
    std::vector<std::string> names;
    for (Expr e : known) names.push_back(symbol_of(e).name);
    throw Error(text(what, ": '", to_text(leaf), "' is not an unknown of this model.",
                     did_you_mean(symbol_of(leaf).name, names)));
  }
}

dae::LeafValues read_leaf_values(lua_State* L, int index, const std::string& what, const dae::Model& model) {
  if (lua_istable(L, index)) {
    refuse_expressions(L, index, what);
    refuse_known(L, index, what, model);
  }
  const std::vector<Expr> known = known_leaves(model);
  dae::LeafValues given = to_symbol_numbers(L, index, what, known);
  refuse_foreign(given, what, known);
  return given;
}

std::vector<Expr> known_leaves(const dae::Model& model) {
  std::vector<Expr> known;
  for (const dae::Model* m = &model; m; m = m->parent.get())
    for (const auto& v : m->variables)
      for (int k = 0; k <= std::max(v.order, 1); ++k) known.push_back(derivative_leaf(v.leaf, k));
  return known;
}

void add_declared(dae::StartRequest& request, const dae::Model& model) {
  std::unordered_map<Expr, double> values;
  for (Expr p : model.parameters) {
    const auto asked = request.parameters.find(p);
    const auto own = model.values.find(p);
    if (asked != request.parameters.end())
      values[p] = number_value(asked->second).value_or(0);
    else if (own != model.values.end())
      values[p] = number_value(own->second).value_or(0);
  }
  const auto says = [](const dae::LeafValues& list, Expr leaf) {
    return std::any_of(list.begin(), list.end(), [&](const auto& entry) { return entry.first == leaf; });
  };
  const auto add = [&](Expr leaf, Expr value, dae::LeafValues& target) {
    target.push_back({leaf, evaluate({&value, 1}, values)[0]});
  };
  for (const auto& [leaf, value] : model.start_values) {
    if (says(request.fix, leaf)) continue;
    add(leaf, value, says(request.guess, leaf) ? request.declared : request.fix);
  }
  for (const auto& [leaf, value] : model.start_guesses)
    if (!says(request.fix, leaf) && !says(request.guess, leaf)) add(leaf, value, request.guess);
}

dae::StartRequest read_start_request(lua_State* L, const Options& options, const dae::Model& model) {
  dae::StartRequest request;
  for (const auto& [key, target] : {std::pair{"fix", &request.fix}, std::pair{"guess", &request.guess}})
    if (options.has(key)) {
      *target = read_leaf_values(L, options.push(key), key, model);
      lua_pop(L, 1);
    }
  if (options.has("params")) {
    const int inputs = options.push("inputs"), events = options.push("events");
    const auto others = parameters_beside(L, inputs, events);
    request.parameters = read_parameters(L, options.push("params"), model, "params", others);
    lua_pop(L, 3);
  }
  request.t = options.number("from", 0);
  const Inputs inputs = read_inputs(options, model, L);
  request.inputs = inputs.expressions;
  for (const auto& input : inputs.numeric) {
    request.inputs[input.leaf] = Expr(input.value(request.t));
    request.numeric_inputs.push_back(input.leaf);
  }
  return request;
}

dae::ParameterValues parameter_overrides(const dae::ConsistentState& at) {
  dae::ParameterValues overrides;
  for (Expr p : at.model->parameters) {
    const auto used = at.values.find(p);
    const auto own = at.model->values.find(p);
    if (used == at.values.end()) continue;
    if (own == at.model->values.end() || number_value(own->second) != used->second)
      overrides[p] = Expr(used->second);
  }
  return overrides;
}

static dae::ConsistentStatePtr translated_states(const dae::ConsistentStatePtr& at,
                                                 const dae::ModelPtr& model);

/// For form "dummy" the choice of states in `model` may be singular at this start. All choices have the same
/// leaves; their values come from a choice that is regular here.
static dae::ConsistentStatePtr translated_to_dummies(const dae::ConsistentStatePtr& at,
                                                     const dae::ModelPtr& model) {
  const dae::ModelPtr source = dae::original(model);
  auto point = at->values;
  for (Expr leaf : source->states())
    if (const auto value = at->value_for(*source, leaf)) point[leaf] = *value;
  const dae::ModelPtr good = dae::reduce_dummy(source, dae::select_dummies(source, point));
  const dae::ConsistentStatePtr there = translated_states(at, good);
  auto here = std::make_shared<dae::ConsistentState>(*there);
  here->model = model;
  here->rows.clear();
  for (const auto& list : {model->states(), model->top_derivatives(), model->algebraic()})
    for (Expr leaf : list)
      if (const auto it = there->values.find(dae::resolve(*good, dae::original_leaf(*model, leaf)));
          it != there->values.end())
        here->values[leaf] = it->second;
  return here;
}

/// Form "minimal" has taken one root of a quadratic constraint; a start on the other root is rejected.
static void require_same_branch(const dae::ConsistentState& at, const dae::ConsistentState& here,
                                const dae::Model& model) {
  const dae::ModelPtr source = dae::original(here.model);
  for (Expr leaf : source->states()) {
    const auto given = at.values.find(leaf);
    const Expr own = dae::resolve(model, leaf);
    if (given == at.values.end() || own == leaf) continue;
    const std::vector<Expr> inside = leaves({&own, 1});
    if (!std::all_of(inside.begin(), inside.end(), [&](Expr e) {
          return here.values.count(e) || symbol_of(e).kind == pendula::Kind::constant;
        }))
      continue;
    const double now = pendula::evaluate({&own, 1}, here.values)[0];
    if (std::fabs(now - given->second) <= 1e-6 * (std::fabs(now) + std::fabs(given->second)) + 1e-9) continue;
    throw Error(text("the start has ", to_text(leaf), " = ", rounded(given->second, 6),
                     ", but form \"minimal\" was made where ", to_text(leaf), " = ", to_text(own), " = ",
                     rounded(now, 6), "; make the form at this start: reduce(\"minimal\", { at = start })"));
  }
}

/// Rejects a start at which rows of form "array", chosen at another point, have another solution. For a
/// mechanism at rest that may belong to motions that its own equations exclude.
static void require_same_values(const dae::ConsistentState& at, const dae::ConsistentState& here,
                                const dae::Model& model) {
  constexpr double same = 1e-6, rounding = 1e-9;  // relative to the two values; relative to the largest value
  double largest = 0;
  for (const auto& [leaf, value] : at.values) largest = std::max(largest, std::fabs(value));
  const dae::ModelPtr source = dae::original(at.model);
  // derivatives that are determined; the others of the array have arbitrary values
  for (const auto& list : {source->states(), source->top_derivatives(), source->algebraic()})
    for (Expr leaf : list) {
      const auto given = at.values.find(leaf), now = here.values.find(dae::resolve(model, leaf));
      if (given == at.values.end() || now == here.values.end()) continue;
      const double difference = std::fabs(now->second - given->second);
      if (difference > same * (std::fabs(now->second) + std::fabs(given->second)) + rounding * largest)
        throw Failure(text("form \"array\" has ", to_text(leaf), " = ", rounded(now->second, 6),
                           " at this start, where it is ", rounded(given->second, 6)));
    }
}

/// In form "array" whose rows were chosen at another point and do not determine the unknowns at this start:
/// the start of the form whose rows are chosen here, or the failure of the rows that are there.
static dae::ConsistentStatePtr translated_to_rows(const dae::ConsistentStatePtr& at,
                                                  const dae::ModelPtr& model) {
  try {
    return translated_states(at, model);
  } catch (const UserFacing&) {
    try {
      const dae::ModelPtr source = dae::original(model);
      dae::ReduceOptions here;
      here.at = translated_choosing(at, source)->values;
      return translated_states(at, dae::reduce_array(source, here));
    } catch (const UserFacing&) {  // the first failure is that of the form that was asked for
    }
    throw;
  }
}

dae::ConsistentStatePtr translated_choosing(const dae::ConsistentStatePtr& at, const dae::ModelPtr& model) {
  if (at->model == model) return at;
  constexpr std::size_t few = 8;
  using Pair = std::pair<dae::ConsistentStatePtr, dae::ModelPtr>;
  struct Hash {
    std::size_t operator()(const Pair& pair) const {
      return std::hash<dae::ConsistentStatePtr>()(pair.first) ^ 31 * std::hash<dae::ModelPtr>()(pair.second);
    }
  };
  static LruCache<Pair, dae::ConsistentStatePtr, Hash> known(few);
  if (const auto* found = known.find({at, model})) return *found;
  return known.insert({at, model}, model->form == "dummy"   ? translated_to_dummies(at, model)
                                   : model->form == "array" ? translated_to_rows(at, model)
                                                            : translated_states(at, model));
}

void require_rows(const dae::ConsistentState& at, const dae::ModelPtr& model) {
  if (at.model == model) return;
  throw Error(
      "the rows that this form \"array\" was made of do not determine the unknowns at this start; "
      "make it there: reduce(\"array\", { at = start })");
}

dae::ConsistentStatePtr translated(const dae::ConsistentStatePtr& at, const dae::ModelPtr& model) {
  dae::ConsistentStatePtr here = translated_choosing(at, model);
  require_rows(*here, model);
  return here;
}

static dae::ConsistentStatePtr translated_states(const dae::ConsistentStatePtr& at,
                                                 const dae::ModelPtr& model) {
  dae::StartRequest request;
  request.t = at->t;
  request.keep_invariants = false;
  for (Expr leaf : model->states()) {
    const auto value = at->value_for(*model, leaf);
    if (!value)
      throw Error(text("start has no value for '", to_text(leaf),
                       "': it belongs to another model; make one with sys:init{ … }"));
    request.fix.push_back({leaf, *value});
  }
  for (const auto& list :
       {model->algebraic(), model->top_derivatives()})  // selects the root of nonlinear equations
    for (Expr leaf : list)
      if (const auto value = at->value_for(*model, leaf)) request.guess.push_back({leaf, *value});
  request.inputs = at->request.inputs;  // as expressions, whose derivatives are known
  request.numeric_inputs = at->request.numeric_inputs;
  for (Expr leaf : model->inputs)
    if (const auto value = at->value_for(*model, leaf); value && !request.inputs.count(leaf)) {
      request.inputs[leaf] = Expr(*value);
      request.numeric_inputs.push_back(leaf);
    }
  for (const auto& [p, value] : parameter_overrides(*at))
    if (std::find(model->parameters.begin(), model->parameters.end(), p) != model->parameters.end())
      request.parameters[p] = value;
  // The origin of every value is that in the original start, since sensitivities depend on it.
  auto result = std::make_shared<dae::ConsistentState>(*dae::init(model, request));
  if (model->form == "minimal") require_same_branch(*at, *result, *model);
  if (model->form == "array") require_same_values(*at, *result, *model);
  std::unordered_map<Expr, dae::Origin> origins;
  for (const dae::LedgerRow& original : at->rows) {
    origins[original.leaf] = original.origin;
    origins[dae::resolve(*model, original.leaf)] = original.origin;
  }
  for (dae::LedgerRow& row : result->rows)
    if (const auto it = origins.find(row.leaf); it != origins.end()) row.origin = it->second;
  return result;
}

/// The states whose values are unknown without a start from the user: all or none.
static std::vector<Expr> without_start(const dae::Model& model) {
  return model.start_values.empty() ? model.states() : std::vector<Expr>();
}

/// The start of a model without freedom, for instance with a position given by t.
static dae::ConsistentStatePtr only_start(lua_State* L, const Options& options, const dae::ModelPtr& model) {
  try {
    dae::StartRequest request = read_start_request(L, options, *model);
    request.of_run = true;
    return dae::init(model, request);
  } catch (const UserFacing&) {
    return nullptr;
  }
}

[[noreturn]] static void refuse_without_start(std::vector<Expr> states) {
  constexpr std::size_t most = 6;
  const bool more = states.size() > most;
  states.resize(std::min(states.size(), most));
  throw Error(text("needs a start: start = sys:init{ fix = { … } }, or a table start = { x = 1 }; ",
                   "nothing gives a value to ", dae::grouped_names(states), more ? ", …" : ""));
}

int push_start(lua_State* L, const Options& options) {
  const int index = options.push("start");
  if (object_type(L, index) != "solution") return index;
  lua_getfield(L, index, "state");  // as in sol:state(nil, { inputs = … })
  lua_pushvalue(L, index);
  lua_pushnil(L);
  lua_createtable(L, 0, 1);
  if (options.has("inputs")) {
    options.push("inputs");
    lua_setfield(L, -2, "inputs");
  }
  protected_call(L, 3, 1);
  lua_replace(L, index);
  return index;
}

dae::ConsistentStatePtr start_of_rows(const dae::StartRequest& request, const dae::ModelPtr& model) {
  dae::ConsistentStatePtr at, own;
  try {
    at = dae::init(dae::original(model), request);
  } catch (const UserFacing&) {  // conditions on unknowns of the form
    return dae::init(model, request);
  }
  try {
    own = dae::init(model, request);
    require_same_values(*at, *own, *model);
    return own;
  } catch (const UserFacing&) {
  }
  try {
    return translated_choosing(at, model);
  } catch (const UserFacing&) {
    if (own && own->lost) return own;  // its values differ by their rounding errors, and it says so
    throw;
  }
}

dae::ConsistentStatePtr read_start(lua_State* L, const Options& options, const dae::ModelPtr& model) {
  if (const std::vector<Expr> open = without_start(*model); !options.has("start") && !open.empty()) {
    if (const dae::ConsistentStatePtr only = only_start(L, options, dae::original(model)))
      return translated_choosing(only, model);
    refuse_without_start(open);
  }
  const int index = push_start(L, options);
  if (lua_isuserdata(L, index)) {
    const auto* held = object_at(L, index, TypeName<dae::ConsistentState>::value);
    if (!held)
      throw Error(text("start must be a result of init, a solution or a table { x = 1, … }, got ",
                       describe(L, index)));
    const auto at = std::static_pointer_cast<const dae::ConsistentState>(*held);
    lua_pop(L, 1);
    return translated_choosing(at, model);
  }
  if (!lua_istable(L, index) && !lua_isnil(L, index))
    throw Error(
        text("start must be a result of init, a solution or a table { x = 1, … }, got ", describe(L, index)));
  dae::StartRequest request = read_start_request(L, options, *model);
  if (lua_istable(L, index)) request.fix = read_leaf_values(L, index, "start", *model);
  request.of_run = true;
  add_declared(request, *model);
  lua_pop(L, 1);
  if (model->form == "dummy") return translated(dae::init(dae::original(model), request), model);
  if (model->form == "array") return start_of_rows(request, model);
  try {
    const dae::ConsistentStatePtr at = dae::init(model, request);
    if (at->lost) warn(at->lost_digits_text());
    return at;
  } catch (const Error& conflict) {
    if (model->invariants.empty()) throw;
    request.keep_invariants = false;
    dae::ConsistentStatePtr at;
    try {
      at = dae::init(model, request);
    } catch (const UserFacing&) {
      throw conflict;  // the invariants are not the cause; the first explanation holds
    }
    std::vector<std::string> broken;
    for (const auto& [c, value] : at->constraints)
      if (std::fabs(value) > 1e-9) broken.push_back(text(c.label, " = ", rounded(value, 4)));
    warn(text("the start is inconsistent: ", join(broken, ", "),
              "; sol:drift() shows the effect on the constraints"));
    return at;
  }
}

}  // namespace pendula::lua
