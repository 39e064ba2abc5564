// The `mech` module: Lagrange mechanics. Reads arguments, calls src/mech.
#include "mech/lagrangian.hpp"

#include "dae/model/make_model.hpp"
#include "dae/regularise/least_norm.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"
#include "lua/read/inputs.hpp"
#include "lua/read/traced.hpp"

namespace pendula::lua {

template <>
struct TypeName<mech::MatrixForm> {
  static constexpr const char* value = "matrix_form";
};

namespace {

/// Splits L = T - V into T and V, where V is the part of -L without velocities.
void split(Expr L, mech::Lagrangian& system) {
  Substitution at_rest;
  for (Expr q : system.q) at_rest.emplace(derivative_leaf(q), Expr(0));
  system.V = simplify(-substitute({&L, 1}, at_rest)[0]);
  system.T = simplify(L + system.V);
}

using Forces = std::vector<std::pair<VecX, VecX>>;
struct VirtualWork {
  Forces forces;
};

}  // namespace

template <>
struct TypeName<VirtualWork> {
  static constexpr const char* value = "virtual_work";
};

namespace {

/// The table [column made by generalized_force] = its forces, with weak keys.
void push_known_forces(lua_State* L) {
  if (luaL_getsubtable(L, LUA_REGISTRYINDEX, "pendula.virtual_work")) return;
  lua_createtable(L, 0, 1);
  lua_pushliteral(L, "k");
  lua_setfield(L, -2, "__mode");
  lua_setmetatable(L, -2);
}

/// Records the forces of the column on top of the stack, for the derivation of a model.
void remember_forces(lua_State* L, Forces forces) {
  push_known_forces(L);
  lua_pushvalue(L, -2);
  push_object(L, std::make_shared<const VirtualWork>(VirtualWork{std::move(forces)}),
              TypeName<VirtualWork>::value);
  lua_rawset(L, -3);
  lua_pop(L, 1);
}

/// The forces from which the column at `index` was made; empty if it was made otherwise.
Forces known_forces(lua_State* L, int index) {
  lua_pushvalue(L, index);
  push_known_forces(L);
  lua_insert(L, -2);
  lua_rawget(L, -2);
  const auto* held = object_at(L, -1, TypeName<VirtualWork>::value);
  Forces forces = held ? static_cast<const VirtualWork*>(held->get())->forces : Forces{};
  lua_pop(L, 2);
  return forces;
}

/// Pairs { {p, F}, {p, F} }.
int generalized_force(Call& call) {
  lua_State* L = call.L;
  const VecX q = to_column(L, 1, "q");
  call.table(2, "forces");
  std::vector<std::pair<VecX, VecX>> forces;
  for (lua_Integer i = 1, n = luaL_len(L, 2); i <= n; ++i) {
    if (lua_geti(L, 2, i) != LUA_TTABLE)
      throw Error(text("force ", i, " must be a pair {point, force}, got ", describe(L, -1)));
    lua_geti(L, -1, 1);
    lua_geti(L, -2, 2);
    forces.push_back({to_column(L, -2, text("the point of force ", i)), to_column(L, -1, text("force ", i))});
    lua_pop(L, 3);
  }
  push_matrix(L, MatX(mech::generalized_force(q, forces)));
  remember_forces(L, std::move(forces));
  return 1;
}

int lagrange(Call& call) {
  const Options o = call.options(1);
  if (!o.has("q") || (!o.has("T") && !o.has("L")))
    throw Error("expected { q =, T =, V =, C =, Q = }: q and T are required (or q and L = T - V)");
  if (o.has("L") && (o.has("T") || o.has("V"))) throw Error("give T and V, or L = T - V alone");
  mech::Lagrangian system;
  system.q = option_column(call, o, "q");
  if (o.has("L")) {
    split(to_expr(call.L, o.push("L"), "L"), system);
  } else {
    system.T = to_expr(call.L, o.push("T"), "T");
  }
  lua_pop(call.L, 1);
  if (o.has("V")) {
    system.V = to_expr(call.L, o.push("V"), "V");
    lua_pop(call.L, 1);
  }
  if (o.has("C")) {
    const std::vector<Expr> C = to_residuals(call.L, o.push("C"), "C");
    system.C = column(C);
    lua_pop(call.L, 1);
  }
  if (o.has("Q")) {
    const int Q = o.push("Q");
    system.forces = known_forces(call.L, Q);
    system.Q = to_column(call.L, Q, "Q");
    lua_pop(call.L, 1);
  }
  system.multipliers = o.string("multipliers", "z");
  system.name = o.string("name", "");
  return call.push(mech::lagrange(system));
}

int independent(Call& call) {
  const auto model = call.shared<dae::Model>(1, "model");
  const Options o = call.options(2);
  std::unordered_map<Expr, double> near;
  for (const char* key : {"guess", "fix"}) {
    if (!o.has(key)) continue;
    for (const auto& [leaf, value] : read_leaf_values(call.L, o.push(key), key, *model)) near[leaf] = value;
    lua_pop(call.L, 1);
  }
  dae::ParameterValues values;
  if (o.has("params")) {
    values = read_parameters(call.L, o.push("params"), *model, "params", {});
    lua_pop(call.L, 1);
  }
  return call.push(dae::independent(values.empty() ? model : dae::with_values(model, values), near));
}

const dae::Mechanics& mechanics(Call& call) {
  const auto& model = call.object<dae::Model>(1, "model");
  if (!model.mechanics)
    throw Error("this model was not made by lagrange{ … }: it has no mass matrix, energy or constraints C");
  return *model.mechanics;
}

int M(Call& call) {
  const auto n = mechanics(call).q.size();
  return push_matrix(call.L, dae::dense(mechanics(call).M, n, n));
}
int rhs(Call& call) { return push_matrix(call.L, MatX(mechanics(call).rhs)); }
int C(Call& call) { return push_matrix(call.L, MatX(mechanics(call).C)); }
int Q(Call& call) { return push_matrix(call.L, MatX(mechanics(call).Q)); }
int q(Call& call) { return push_matrix(call.L, MatX(mechanics(call).q)); }
int dCdq(Call& call) {
  return push_matrix(call.L,
                     dae::dense(mechanics(call).dCdq, mechanics(call).C.size(), mechanics(call).q.size()));
}
int multipliers(Call& call) { return push_matrix(call.L, MatX(mechanics(call).multipliers)); }
int kinetic(Call& call) { return push_expr(call.L, mechanics(call).T); }
int potential(Call& call) { return push_expr(call.L, mechanics(call).V); }
int energy(Call& call) { return push_expr(call.L, mechanics(call).T + mechanics(call).V); }

int matrix_form(Call& call) {
  return call.push(std::make_shared<const mech::MatrixForm>(mech::matrix_form(mechanics(call))));
}

const mech::MatrixForm& form_of(Call& call) { return call.object<mech::MatrixForm>(1, "matrix form"); }
int form_A(Call& call) { return push_matrix(call.L, form_of(call).A); }
int form_unknowns(Call& call) { return push_matrix(call.L, MatX(form_of(call).unknowns)); }
int form_c(Call& call) { return push_matrix(call.L, MatX(form_of(call).c)); }

int form_text(Call& call) {
  collect_aliases(call.L);
  const auto& form = form_of(call);
  return call.push(mech::describe(form));
}

const OptionTable lagrange_options = {
    {"q", "column or list", "", "the coordinates"},
    {"T", "expression", "", "kinetic energy, in J"},
    {"V", "expression", "0", "potential energy, in J"},
    {"L", "expression", "", "T - V in one, instead of T and V"},
    {"C", "list", "", "constraints 0 = C(q), as expressions or equations"},
    {"Q", "column", "0", "generalized forces: generalized_force(q, { {p, F} }) or any expressions"},
    {"multipliers", "string", "\"z\"", "the name of the multipliers"},
    {"name", "string", "", "the name of the model"},
};

const OptionTable independent_options = {
    {"fix", "table", "", "coordinates that are given there: { a1 = 1 }", "@variables"},
    {"guess", "table", "", "where the search for the others begins", "@variables"},
    {"params", "table", "", "values of parameters: { m = 2 }", "@parameters"},
};

}  // namespace

extern const Module mech_module = {
    "mech",
    "Lagrange mechanics",
    {
        {"lagrange", lagrange, R"(lagrange{ q =, T =, V =, C =, Q =, multipliers = "z", name = } -> model)",
         R"(d/dt ∂L/∂q′ - ∂L/∂q = Q with L = T - V - zᵀC: the equations W(q) q″ + (∂C/∂q)ᵀ z = rhs, 0 =
            C(q). Constraints that follow from others (a multiple, a sum, a circle beside its sphere and plane, a
            crank too many) change nothing: z are then those of least norm, which the model says, and an unknown
            `excess`, 0 at the start, ends a run where a constraint no longer follows.)",
         "th = var \"theta\"  m, g, l = params \"m g l\"  return lagrange{ q = {th}, T = m*l^2*th.dot^2/2, "
         "V = -m*g*l*cos(th) }.rhs[1]",
         "-m g l sin(θ)", &lagrange_options},
        {"generalized_force", generalized_force, "generalized_force(q, { {p, F}, … }) -> column",
         "Virtual work: Q = Σ (∂p/∂q)ᵀ F for forces F at points p(q).",
         "th = var \"theta\"  F = param \"F\"  return generalized_force({th}, { "
         "{vec{sin(th), -cos(th)}, vec{F, 0}} })[1]",
         "F cos(θ)"},
        {"model:independent", independent, "sys:independent{ fix =, guess =, params = } -> model",
         R"(The same motion by independent constraints, for a model whose constraints depend on each other wherever
            it can move near these values. lagrange does so for the positions that it finds; this is for others, and
            for equations by hand, dae{ … } with constraints between states and multipliers that enter linearly.
            Forces of dependent constraints are not unique; z are those of least norm. The other constraints hold by
            themselves; `excess` is by how much they fail: 0 at every start. A run ends where that is a thousandth
            of their terms: behind a position in which the chosen constraints depend on each other.)",
         R"(x, y, z, w = vars "x y z w"
            twice = dae{ der(x, 2) ~ -2*x*(z + w), der(y, 2) ~ -2*y*(z + w) - 9.81, 0 ~ x^2 + y^2 - 1,
              0 ~ (x^2 + y^2)^2 - 1 }
            free = twice:independent{ guess = { x = 1 } }
            return free:index(), free:dof())",
         "3 2", &independent_options},
        {"model#M", M, "sys.M -> matrix", "The mass matrix W(q) = ∂²L/∂q′².", "", ""},
        {"model#rhs", rhs, "sys.rhs -> column", "W(q) q″ + (∂C/∂q)ᵀ z = rhs.", "", ""},
        {"model#q", q, "sys.q -> column", "The generalised coordinates.", "", ""},
        {"model#C", C, "sys.C -> column", "The constraints C(q) = 0.", "", ""},
        {"model#Q", Q, "sys.Q -> column", "The generalised forces.", "", ""},
        {"model#dCdq", dCdq, "sys.dCdq -> matrix", "∂C/∂q, one row per constraint.", "", ""},
        {"model#multipliers", multipliers, "sys.multipliers -> column",
         "The multipliers z of the constraints; the constraint force is -(∂C/∂q)ᵀ z.", "", ""},
        {"model#T", kinetic, "sys.T -> expression", "Kinetic energy.", "", ""},
        {"model#V", potential, "sys.V -> expression", "Potential energy.", "", ""},
        {"model#energy", energy, "sys.energy -> expression",
         "T + V; constant along solutions without forces, if T and V do not depend on t.", "", ""},
        {"model#matrix_form", matrix_form, "sys.matrix_form -> matrix form",
         "[M Cqᵀ; Cq 0][q″; z] = c, without constraints M q″ = rhs.", "", ""},
        {"matrix_form#A", form_A, "form.A -> matrix", "[M Cqᵀ; Cq 0], or M.", "", ""},
        {"matrix_form#unknowns", form_unknowns, "form.unknowns -> column", "[q″; z].", "", ""},
        {"matrix_form#c", form_c, "form.c -> column", "The right side.", "", ""},
        {"matrix_form:__tostring", form_text, "print(form)", "The three blocks side by side.", "", ""},
    }};

}  // namespace pendula::lua
