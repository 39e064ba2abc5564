// The `dae` module: models, conversions, constraints. Reads arguments, calls src/dae.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "base/text.hpp"

#include "dae/index/differentiation_index.hpp"
#include "dae/model/compose.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/report/describe.hpp"
#include "dae/start/start.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/bind/dae/transitions.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"
#include "lua/read/inputs.hpp"

namespace pendula::lua {

VecX option_column(Call& call, const Options& options, const char* key) {
  if (!options.has(key)) return {};
  const VecX v = to_column(call.L, options.push(key), key);
  lua_pop(call.L, 1);
  return v;
}

namespace {

MatX option_matrix(Call& call, const Options& options, const char* key) {
  if (!options.has(key)) return {};
  const MatX m = to_matrix(call.L, options.push(key), key);
  lua_pop(call.L, 1);
  return m;
}

const dae::Model& model_of(Call& call) { return call.object<dae::Model>(1, "model"); }

std::vector<dae::Block> to_blocks(const std::vector<Equation>& equations) {
  std::vector<dae::Block> blocks;
  for (const Equation& e : equations) {
    const VecX l = Eigen::Map<const VecX>(e.lhs.data(), e.lhs.size()),
               r = Eigen::Map<const VecX>(e.rhs.data(), e.rhs.size());
    blocks.push_back({l, r, ""});
  }
  return blocks;
}

/// What stands in dae{ … }: equations, lists of equations, models, and the option `name`.
class ModelReader {
 public:
  explicit ModelReader(lua_State* L) : L_(L) {}

  void read(int list, const std::string& what) {
    const Nesting nesting(L_);
    refuse_keys(list, what);
    const lua_Integer n = list_size(L_, list, what);
    for (lua_Integer i = 1; i <= n; ++i) {
      lua_rawgeti(L_, list, i);
      read_entry(lua_gettop(L_), text("entry ", i, " of ", what));
      lua_settop(L_, list);
    }
  }
  std::vector<dae::Block>& blocks() { return blocks_; }
  /// Symbols of the equations and the derivatives that a start may name.
  std::vector<Expr> nameable() const {
    std::vector<Expr> sides, known;
    for (const dae::Block& b : blocks_)
      for (const VecX* side : {&b.lhs, &b.rhs}) sides.insert(sides.end(), side->begin(), side->end());
    for (Expr leaf : leaves(sides)) {
      known.push_back(leaf);
      if (symbol_of(leaf).kind == Kind::variable) known.push_back(derivative_leaf(leaf));
    }
    for (const dae::ModelPtr& part : parts_)
      for (Expr leaf : known_leaves(*part)) known.push_back(leaf);
    return known;
  }
  dae::ModelPtr model(dae::ModelOptions options) {
    return nested_ ? dae::compose(parts_, std::move(blocks_), std::move(options))
                   : dae::make_model(std::move(blocks_), std::move(options));
  }

 private:
  void read_entry(int at, const std::string& what) {
    if (const auto* part = object_at(L_, at, TypeName<dae::Model>::value)) {
      parts_.push_back(std::static_pointer_cast<const dae::Model>(*part));
      nested_ = true;
      return;
    }
    if (lua_istable(L_, at)) {
      nested_ = true;
      return read(at, what);
    }
    for (dae::Block& block : to_blocks(to_equations(L_, at, what))) blocks_.push_back(std::move(block));
  }
  void refuse_keys(int list, const std::string& what) {
    for (lua_pushnil(L_); lua_next(L_, list) != 0;) {
      lua_pop(L_, 1);
      if (lua_type(L_, -1) == LUA_TSTRING)
        throw Error(text(what, " has the key '", lua_tostring(L_, -1),
                         "' among its equations: write ~, not == or ="));
    }
  }

  lua_State* L_;
  std::vector<dae::Block> blocks_;
  std::vector<dae::ModelPtr> parts_;
  bool nested_ = false;  ///< there are models or lists: an equation for an input closes a loop
};

/// Values by leaf, numbers or expressions in parameters.
std::vector<std::pair<Expr, Expr>> read_start_expressions(lua_State* L, int index,
                                                          std::span<const Expr> known,
                                                          const std::string& what) {
  std::vector<std::pair<Expr, Expr>> values = read_reset(L, index, known, what);
  for (const auto& [leaf, value] : values)
    for (Expr inside : leaves({&value, 1}))
      if (symbol_of(inside).kind != Kind::parameter && symbol_of(inside).kind != Kind::constant)
        throw Error(text(what, ": the value of '", leaf_name(leaf), "' must be a number or an expression in ",
                         "parameters, not ", to_text(value)));
  return values;
}

/// The options of dae{ … } that stand among its equations, by name; they are taken out of the table on top.
struct ModelWords {
  static constexpr const char* all[] = {"name", "events", "start", "guess", "notes"};
  static bool contains(const char* word) {
    return std::any_of(std::begin(all), std::end(all),
                       [&](const char* w) { return std::strcmp(w, word) == 0; });
  }
};

void read_model_words(lua_State* L, int words, ModelReader& reader, dae::ModelOptions& options) {
  std::vector<dae::Block>& blocks = reader.blocks();
  const auto word = [&](const char* key) { return lua_getfield(L, words, key) != LUA_TNIL; };
  const std::vector<Expr> known = reader.nameable();
  if (word("name")) {
    if (lua_type(L, -1) != LUA_TSTRING) throw Error(text("name must be a string, got ", describe(L, -1)));
    options.name = lua_tostring(L, -1);
  }
  if (word("start")) options.start_values = read_start_expressions(L, lua_gettop(L), known, "start");
  if (word("guess")) options.start_guesses = read_start_expressions(L, lua_gettop(L), known, "guess");
  if (word("events")) {
    const int list = lua_gettop(L);
    if (!lua_istable(L, list)) throw Error("events must be a list of tables { { when = y, reset = { … } } }");
    for (lua_Integer i = 1, n = list_size(L, list, "events"); i <= n; ++i) {
      lua_geti(L, list, i);
      const std::string what = text("events[", i, "]");
      options.events.push_back(read_transition(L, lua_gettop(L), known, what));
      lua_pushliteral(L, "call");
      if (lua_rawget(L, -2) != LUA_TNIL)
        throw Error(text(what, ".call: an event of a model cannot call; give it to integrate{ events = … }"));
      lua_settop(L, list);
    }
  }
  if (word("notes")) {
    if (!lua_istable(L, -1)) throw Error("notes must be a list of strings, one for each equation");
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (lua_rawgeti(L, -1, static_cast<lua_Integer>(b + 1)) == LUA_TSTRING)
        blocks[b].note = lua_tostring(L, -1);
      lua_pop(L, 1);
    }
  }
  lua_settop(L, words);
}

/// A list with parts in it is what model{ … } takes.
bool contains_parts(lua_State* L, int list) {
  for (lua_Integer i = 1, n = luaL_len(L, list); i <= n; ++i) {
    lua_rawgeti(L, list, i);
    const bool found = lua_istable(L, -1) && luaL_getmetafield(L, -1, "__model") != LUA_TNIL;
    lua_settop(L, list);
    if (found) return true;
  }
  return false;
}

int make(Call& call) {
  lua_State* L = call.L;
  call.table(1, "equations");
  lua_settop(L, 1);
  if (contains_parts(L, 1)) {
    push_named(L, "model");
    lua_pushvalue(L, 1);
    protected_call(L, 1, 1);
    return 1;
  }
  lua_newtable(L);  // the options
  lua_newtable(L);  // the equations
  const int words = 2, list = 3;
  for (lua_pushnil(L); lua_next(L, 1);) {
    const bool option = lua_type(L, -2) == LUA_TSTRING && ModelWords::contains(lua_tostring(L, -2));
    lua_pushvalue(L, -2);
    lua_insert(L, -2);
    lua_settable(L, option ? words : list);
  }
  ModelReader reader(L);
  reader.read(list, "the list of equations");
  dae::ModelOptions options;
  read_model_words(L, words, reader, options);
  return call.push(reader.model(std::move(options)));
}

int make_semi_explicit(Call& call) {
  const Options o = call.options(1);
  if (!o.has("x") || !o.has("f")) throw Error("expected { x =, z =, u =, f =, g = }: x and f are required");
  return call.push(dae::semi_explicit(option_column(call, o, "x"), option_column(call, o, "z"),
                                      option_column(call, o, "u"), option_column(call, o, "f"),
                                      option_column(call, o, "g"), o.string("name", "")));
}

int make_implicit(Call& call) {
  const Options o = call.options(1);
  if (!o.has("F")) throw Error("expected { x =, z =, u =, F = }: F(x′, x, z, u) is required");
  return call.push(dae::implicit(option_column(call, o, "x"), option_column(call, o, "z"),
                                 option_column(call, o, "u"), option_column(call, o, "F"),
                                 o.string("name", "")));
}

int make_linear(Call& call) {
  const Options o = call.options(1);
  if (!o.has("E") || !o.has("A")) throw Error("expected { E =, A =, B =, u = }: E and A are required");
  return call.push(dae::linear(option_matrix(call, o, "E"), option_matrix(call, o, "A"),
                               option_matrix(call, o, "B"), option_column(call, o, "x"),
                               option_column(call, o, "u"), o.string("name", "")));
}

int kind(Call& call) { return call.push(dae::kind_name(model_of(call).kind)); }
int name(Call& call) { return call.push(model_of(call).name); }
int form(Call& call) { return call.push(model_of(call).form); }

int push_list(Call& call, const std::vector<Expr>& list) { return push_matrix(call.L, MatX(column(list))); }
int differential(Call& call) { return push_list(call, model_of(call).states()); }
int algebraic(Call& call) { return push_list(call, model_of(call).algebraic()); }
int inputs(Call& call) { return push_list(call, model_of(call).inputs); }
int parameters(Call& call) { return push_list(call, model_of(call).parameters); }

int domain(Call& call) {
  std::vector<Expr> factors;
  for (const dae::SingularityCondition& n : model_of(call).singularity_conditions)
    factors.push_back(n.factor);
  return push_list(call, factors);
}

int equations(Call& call) {
  const auto& blocks = model_of(call).blocks;
  lua_createtable(call.L, static_cast<int>(blocks.size()), 0);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    push_equation(call.L, {blocks[b].lhs, blocks[b].rhs});
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(b + 1));
  }
  return 1;
}

void push_values(lua_State* L, const std::vector<std::pair<Expr, Expr>>& values) {
  lua_newtable(L);
  for (const auto& [leaf, value] : values) {
    push_expr(L, leaf);
    push_expr(L, value);
    lua_settable(L, -3);
  }
}

int events(Call& call) {
  lua_State* L = call.L;
  lua_newtable(L);
  lua_Integer n = 0;
  for (const dae::Transition& event : model_of(call).events) {
    lua_newtable(L);
    push_expr(L, event.when);
    lua_setfield(L, -2, "when");
    lua_pushinteger(L, event.direction);
    lua_setfield(L, -2, "direction");
    if (event.stop) {
      lua_pushliteral(L, "stop");
      lua_setfield(L, -2, "action");
    }
    if (!event.reset.empty()) {
      push_values(L, event.reset);
      lua_setfield(L, -2, "reset");
    }
    lua_rawseti(L, -2, ++n);
  }
  return 1;
}

int parameter_values(Call& call) {
  const auto& values = model_of(call).values;
  return push_values(call.L, {values.begin(), values.end()}), 1;
}
int start_values(Call& call) { return push_values(call.L, model_of(call).start_values), 1; }
int start_guesses(Call& call) { return push_values(call.L, model_of(call).start_guesses), 1; }

int to_semi_explicit(Call& call) { return call.push(dae::to_semi_explicit(model_ptr(call))); }
int to_implicit(Call& call) { return call.push(dae::to_implicit(model_ptr(call))); }
int to_first_order(Call& call) { return call.push(dae::to_first_order(model_ptr(call))); }

/// A bare number cannot say that it holds on one branch or in one region only: that goes to the error stream.
static dae::IndexResult index_with_warnings(Call& call) {
  dae::IndexResult known = dae::differentiation_index(model_of(call));
  for (const std::string& note : known.notes) std::fprintf(stderr, "warning: %s\n", note.c_str());
  return known;
}

int index(Call& call) {
  const dae::IndexResult known = index_with_warnings(call);
  if (known.index_is_bound && known.conditions == dae::IndexResult::Conditions::of_regularised)
    throw Failure(
        text("the index is at least 1 and at most ", known.index, ": the ", known.evidence,
             " gives a bound, and the derivative array could not decide; sys:structure() says more"));
  return call.push(known.index);
}
int dof(Call& call) { return call.push(index_with_warnings(call).dof); }

int constraints(Call& call) {
  auto list = std::make_shared<Constraints>();
  dae::HiddenConstraints known = dae::hidden_constraints(model_of(call));
  list->list = std::move(known.constraints);
  list->complete = known.complete;
  return call.push(std::shared_ptr<const Constraints>(list));
}

int with(Call& call) {
  call.table(2, "parameters");
  return call.push(
      dae::with_values(model_ptr(call), read_parameters(call.L, 2, model_of(call), "parameters")));
}

int model_text(Call& call) {
  collect_aliases(call.L);
  return call.push(dae::describe(model_of(call)));
}

// ── constraints ───────────────────────────────────────────────────────────────────────────────────────

int constraints_text(Call& call) {
  collect_aliases(call.L);
  const auto& constraints = call.object<Constraints>(1, "constraints");
  const auto& list = constraints.list;
  const char* incomplete =
      "incomplete: there are conditions that elimination does not write out (sys:structure() counts them)";
  if (list.empty() && !constraints.complete) return call.push(incomplete);
  if (list.empty())
    return call.push("no conditions: every initial value of the differential variables is free");
  Table table;
  for (const auto& c : list)
    table.row({c.label + ":", "0 = " + dae::truncated_text(c.residual),
               c.origin < 0        ? ""
               : c.derivative == 0 ? text("from (", c.origin + 1, ")")
                                   : text("(", c.origin + 1, ") differentiated",
                                          c.derivative == 1 ? "" : text(" ", c.derivative, " times"))});
  std::string out = table.str();
  return call.push(constraints.complete ? out.substr(0, out.size() - 1) : out + incomplete);
}

int constraints_length(Call& call) {
  return call.push(static_cast<long>(call.object<Constraints>(1, "constraints").list.size()));
}

int constraints_item(Call& call) {
  const auto& list = call.object<Constraints>(1, "constraints").list;
  const long i = call.integer(2, "index");
  if (i < 1 || i > static_cast<long>(list.size()))
    throw Error(
        text(list.size() == 1 ? "there is 1 constraint" : text("there are ", list.size(), " constraints"),
             "; number ", i, " does not exist"));
  MatX zero = MatX::Zero(1, 1), residual(1, 1);
  residual(0, 0) = list[i - 1].residual;
  return push_equation(call.L, {zero, residual});
}

const OptionTable semi_explicit_options = {
    {"x", "column or list", "", "the states"},   {"z", "column or list", "{}", "the algebraic variables"},
    {"u", "column or list", "{}", "the inputs"}, {"f", "column or list", "", "x′"},
    {"g", "column or list", "{}", "what is 0"},  {"name", "string", "", "the name of the model"},
};
const OptionTable implicit_options = {
    {"x", "column or list", "", "the states"},       {"z", "column or list", "{}", "the algebraic variables"},
    {"u", "column or list", "{}", "the inputs"},     {"F", "column or list", "", "what is 0, in x′, x, z, u"},
    {"name", "string", "", "the name of the model"},
};
const OptionTable linear_options = {
    {"E", "matrix", "", "of x′"},
    {"A", "matrix", "", "of x"},
    {"B", "matrix", "", "of u"},
    {"x", "column", "", "the variables; made if they are not given"},
    {"u", "column", "", "the inputs; made if they are not given"},
    {"name", "string", "", "the name of the model"},
};

}  // namespace

extern const Module dae_module = {
    "dae",
    "Differential-algebraic equations",
    {
        {"dae", make, R"(dae{ equation, equation, …, name =, start =, guess =, events =, notes = } -> model)",
         R"(A model from any mix of scalar and column equations (lhs ~ rhs). Unknowns are the variables
            that occur; inputs and parameters are recognised. A model, or a list of equations, may stand among
            the equations; an equation for an input of such a model closes the loop: dae{ plant, F ~ -10*x }.
            start = { [x] = 1 } and guess are values that every start of the model has unless it says otherwise,
            events = { { when =, direction =, reset = { … } } } happen in every run, notes stand beside the
            equations. With parts among the equations it is model{ … }.)",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z - x, 0 ~ x + 2*z }.kind)", "semi-explicit"},
        {"dae.semi_explicit", make_semi_explicit,
         "dae.semi_explicit{ x =, z =, u =, f =, g =, name = } -> model",
         "x′ = f(x, z, u), 0 = g(x, z, u). Symbols that are not declared in x, z, u are refused.",
         R"(x, z = vars "x z"  return dae.semi_explicit{ x = x, z = z, f = z - x, g = x + 2*z }:index())",
         "1", &semi_explicit_options},
        {"dae.implicit", make_implicit, "dae.implicit{ x =, z =, u =, F =, name = } -> model",
         "F(x′, x, z, u) = 0.", R"(x = var "x"  return dae.implicit{ x = x, F = der(x)^3 + x }.kind)",
         "implicit ODE", &implicit_options},
        {"dae.linear", make_linear, "dae.linear{ E =, A =, B =, x =, u = } -> model",
         "E x′ = A x + B u; x and u are made if they are not given.",
         "return #dae.linear{ E = {{1, 0}, {0, 0}}, A = eye(2) }.differential", "1", &linear_options},
        {"model#kind", kind, "sys.kind -> string",
         R"("ODE", "implicit ODE", "semi-explicit" or "fully implicit".)", "", ""},
        {"model#name", name, "sys.name -> string", "The name given to the model.", "", ""},
        {"model#form", form, "sys.form -> string", R"(The form reduce() made: "acc", "project" …, or "".)",
         "", ""},
        {"model#differential", differential, "sys.differential -> column",
         "The states: every variable that is differentiated, with its lower derivatives.", "", ""},
        {"model#algebraic", algebraic, "sys.algebraic -> column",
         "The variables that occur without derivative.", "", ""},
        {"model#inputs", inputs, "sys.inputs -> column", "Known functions of time.", "", ""},
        {"model#parameters", parameters, "sys.parameters -> column",
         "Constants whose values can be changed with sys:with{ … }.", "", ""},
        {"model#domain", domain, "sys.domain -> column",
         R"(What a reduced form divided by: it is equivalent to the model where none of these expressions
            vanishes, and integrate() stops where one does.)",
         "x, y, z = vars \"x y z\"  return dae{ der(x) ~ z, der(y) ~ 1, 0 ~ x*y^2 - t "
         "}:reduce(\"minimal\").domain[1]",
         "y"},
        {"model#equations", equations, "sys.equations -> list of equations",
         "The equations as they were written; equation i is number (i).", "", ""},
        {"model#events", events, "sys.events -> list of { when =, direction =, action =, reset = }",
         "The events that belong to the model and happen in every run.", "", ""},
        {"model#values", parameter_values, "sys.values -> table",
         "The values of the parameters, by symbol: those they were made with, or those of sys:with.",
         "k = param(\"k\", 2)  x = var \"x\"  return dae{ der(x) ~ -k*x }:with{ k = 3 }.values[k]", "3"},
        {"model#start_values", start_values, "sys.start_values -> table",
         "Values that a start of the model has unless it is given another.", "", ""},
        {"model#start_guesses", start_guesses, "sys.start_guesses -> table",
         "Where the search for a start begins.", "", ""},
        {"model:semi_explicit", to_semi_explicit, "sys:semi_explicit() -> model",
         "x′ = f, 0 = g. A fully implicit model gets x′ = δ with new algebraic variables δ.",
         R"(x = var "x"  return dae{ der(x)^2 ~ x }:semi_explicit())",
         R"(semi-explicit DAE, 1 differential + 1 algebraic variables, index 1, 1 free initial value
  (1)  x′ = δ_x
  (2)  0 = δ_x² - x
  differential  x
  algebraic     δ_x)"},
        {"model:implicit", to_implicit, "sys:implicit() -> model", "0 = F(x′, x, z, u).",
         R"(x = var "x"  sys = dae{ der(x) ~ -x }  return sys:implicit())",
         R"(implicit ODE, 1 differential variable, index 0, 1 free initial value
  (1)  0 = x′ + x
  differential  x
  ∂F/∂x′        nonsingular (rank 1): an implicit ODE)"},
        {"model:first_order", to_first_order, "sys:first_order() -> model",
         "Derivatives of order two and more become new variables.",
         R"(x = var "x"  return dae{ der(x, 2) ~ -x }:first_order())",
         R"(ODE, 2 differential variables, index 0, 2 free initial values
  (1)  x′ = v
  (2)  v′ = -x
  differential  x, v)"},
        {"model:index", index, "sys:index() -> integer",
         "The differentiation index, from structure and checked by the rank of the system Jacobian.",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:index())", "2"},
        {"model:dof", dof, "sys:dof() -> integer", "The number of free initial values.",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:dof())", "0"},
        {"model:constraints", constraints, "sys:constraints() -> constraints",
         R"(Every condition on the initial values of the states, explicit and hidden, with the equation it
            came from.)",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:constraints())",
         "(2):  0 = x - sin(t)  from (2)"},
        {"model:with", with, "sys:with{ m = 2 } -> model", "The same model with other parameter values.",
         R"(x, k = var "x", param "k=1"  return dae{ der(x) ~ -k*x }:with{ k = 3 }.values[k])", "3"},
        {"model:__tostring", model_text, "print(sys)", "Header, numbered equations, unknowns and parameters.",
         "", ""},
        {"constraints:__tostring", constraints_text, "print(sys:constraints())", "One condition per line.",
         "", ""},
        {"constraints:__len", constraints_length, "#sys:constraints()", "Their number.", "", ""},
        {"constraints:__index", constraints_item, "sys:constraints()[i] -> equation", "0 ~ condition.", "",
         ""},
    }};

}  // namespace pendula::lua
