// Properties of a model: its parts, conversions, index and conditions. Reads arguments, calls src/dae.
#include "lua/bind/dae/dae.hpp"

#include "base/counted.hpp"
#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/report/describe.hpp"
#include "dae/report/structure_report.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"
#include "lua/read/inputs.hpp"
#include "lua/screen/pager.hpp"

namespace pendula::lua {
namespace {

const dae::Model& model_of(Call& call) { return call.object<dae::Model>(1, "model"); }

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
    lua_pushinteger(L, static_cast<int>(event.direction));
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
  push_values(call.L, {values.begin(), values.end()});
  return 1;
}
int start_values(Call& call) {
  push_values(call.L, model_of(call).start_values);
  return 1;
}
int start_guesses(Call& call) {
  push_values(call.L, model_of(call).start_guesses);
  return 1;
}

int to_semi_explicit(Call& call) { return call.push(dae::to_semi_explicit(model_ptr(call))); }
int to_implicit(Call& call) { return call.push(dae::to_implicit(model_ptr(call))); }
int to_first_order(Call& call) { return call.push(dae::to_first_order(model_ptr(call))); }

static void require_regular_at(const dae::ModelPtr& model, const dae::ConsistentStatePtr& start) {
  const dae::StructureReport there = dae::structure(model, start);
  if (!there.analysis.regular)
    throw Failure(
        "the structural analysis of this model fails: sys:index() takes the index from the derivative array, "
        "and a start has no effect on it");
  if (there.gap == 0.0)
    throw Failure(
        "the system Jacobian is singular at this start, where the index changes; "
        "sys:structure(start) says more");
}

/// The index, with a warning on the error stream if it holds on one branch or in one region only, since a
/// plain number cannot express that.
///
/// If no values that satisfy the equations are found, the index rests on the structure alone; the error then
/// asks for such values, argument 2.
static dae::IndexResult index_with_warnings(Call& call) {
  dae::IndexResult known = dae::differentiation_index(model_of(call));
  const auto start = call.has(2) ? call.shared<dae::ConsistentState>(2, "start") : nullptr;
  if (start) require_regular_at(model_ptr(call), start);
  if (known.is_unconfirmed && !start)
    throw Failure(
        text("no values that satisfy the equations were found. If some exist, the structural index is ",
             known.index, ", ", counted(static_cast<std::size_t>(known.dof), "free initial value"),
             "; start = sys:init{ guess = { … } } searches near your guess; then sys:index(start) and "
             "sys:dof(start) use its result"));
  for (const std::string& note : known.notes) warn(note);
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
  list->model = model_ptr(call);
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

/// "(2a)": the row of the equation that a condition came from.
std::string equation_of(const dae::Constraint& c, const dae::Model* model) {
  if (!c.origin) return "several equations";
  const auto block = static_cast<std::size_t>(*c.origin);
  const bool known = model && block < model->blocks.size() && c.row < model->blocks[block].lhs.size();
  return known ? row_label(model->blocks[block], *c.origin, c.row) : text("(", *c.origin + 1, ")");
}

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
               : c.derivative == 0 ? "from " + equation_of(c, constraints.model.get())
                                   : text(equation_of(c, constraints.model.get()), " differentiated",
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

}  // namespace

extern const Module dae_module = {
    "dae",
    "Differential-algebraic equations",
    {
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
         R"(The divisors of a reduced form: it is equivalent to the model where none of these expressions
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
        {"model:index", index, "sys:index([start]) -> integer",
         R"(The differentiation index, from the structure and the rank of the derivative array at values that satisfy
            the equations; start: at these.)",
         R"(x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:index())", "2"},
        {"model:dof", dof, "sys:dof([start]) -> integer", "The number of free initial values.",
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
        {"constraints:__index", constraints_item, "sys:constraints()[i] -> equation", "0 ~ condition.", R"(
             x, z = vars "x z"
             c = dae{ der(x) ~ z, 0 ~ x - sin(t) }:constraints()
             #c, c[1])",
         "1 0 = x - sin(t)"},
    }};

}  // namespace pendula::lua
