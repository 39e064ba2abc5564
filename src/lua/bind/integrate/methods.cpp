// Methods other than tableaus: linear multistep (bdf) and Rosenbrock.
#include <cmath>

#include "base/text.hpp"
#include "integrate/run/methods.hpp"
#include "lua/bind/integrate/tableau.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {
namespace {

using integrate::Multistep;
using integrate::Rosenbrock;

// ── multistep ─────────────────────────────────────────────────────────────────────────────────────────

const Multistep& multistep(Call& call) { return call.object<Multistep>(1, "method"); }

int push_new(Call& call, Multistep method) {
  return call.push(std::make_shared<const Multistep>(std::move(method)));
}

int bdf(Call& call) { return push_new(call, integrate::bdf(call.integer(1, "steps"))); }

Multistep::Fractions read_fractions(lua_State* L, int index, const std::string& what) {
  const VecX list = read_list(L, index, what);
  Multistep::Fractions result;
  for (Eigen::Index i = 0; i < list.size(); ++i) {
    const mpq_class* value = exact_value(list[i]);
    if (!value) throw Error(text(what, "[", i + 1, "] must be an exact number such as \"3/2\""));
    result.push_back(*value);
  }
  return result;
}

int make_multistep(Call& call) {
  const Options options = call.options(1);
  if (!options.has("alpha") || !options.has("beta"))
    throw Error("expected { alpha = {…}, beta = {…} }, the coefficients of the points x₊₁, x, x₋₁, …");
  const auto alpha = read_fractions(call.L, options.push("alpha"), "alpha");
  const auto beta = read_fractions(call.L, options.push("beta"), "beta");
  return push_new(call, Multistep(options.string("name", "multistep"), alpha, beta));
}

int push_fractions(Call& call, const Multistep::Fractions& list) {
  VecX column(static_cast<Eigen::Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) column[i] = Expr(list[i]);
  return push_matrix(call.L, MatX(column));
}

int ms_name(Call& call) { return call.push(multistep(call).name()); }
int ms_steps(Call& call) { return call.push(multistep(call).steps()); }
int ms_alpha(Call& call) { return push_fractions(call, multistep(call).alpha()); }
int ms_beta(Call& call) { return push_fractions(call, multistep(call).beta()); }
int ms_order(Call& call) { return call.push(multistep(call).order()); }
int ms_constant(Call& call) {
  return push_matrix(call.L, MatX(MatX::Constant(1, 1, Expr(multistep(call).error_constant()))));
}
int ms_text(Call& call) { return call.push(multistep(call).str()); }
int ms_report(Call& call) { return call.push(multistep(call).report()); }

int upvalue(lua_State* L) {
  lua_pushvalue(L, lua_upvalueindex(1));
  return 1;
}

int ms_stability(Call& call) {
  const Multistep& method = multistep(call);
  lua_createtable(call.L, 0, 8);
  const auto number = [&](const char* key, double value) {
    lua_pushnumber(call.L, value);
    lua_setfield(call.L, -2, key);
  };
  const auto boolean = [&](const char* key, bool value) {
    lua_pushboolean(call.L, value);
    lua_setfield(call.L, -2, key);
  };
  const double alpha = method.alpha_degrees();
  number("alpha", alpha);
  number("real", method.is_zero_stable() ? -method.real_limit() : 0);
  boolean("zero_stable", method.is_zero_stable());
  boolean("A_stable", alpha >= 90);
  boolean("L_stable", alpha >= 90 && method.is_stable_at_infinity());
  boolean("stable_at_infinity", method.is_stable_at_infinity());
  const auto word = [](bool yes) { return yes ? "yes" : "no"; };
  const bool A_stable = alpha >= 90;
  const std::string face =
      text("zero-stable      ", word(method.is_zero_stable()), "\nA(α)-stable      α = ", rounded(alpha, 4),
           "°\nA-stable         ", word(A_stable), "\nL-stable         ",
           word(A_stable && method.is_stable_at_infinity()), "\nat infinity      ",
           method.is_stable_at_infinity() ? "stable" : "not stable");
  lua_createtable(call.L, 0, 1);
  lua_pushlstring(call.L, face.data(), face.size());
  lua_pushcclosure(call.L, upvalue, 1);
  lua_setfield(call.L, -2, "__tostring");
  lua_setmetatable(call.L, -2);
  return 1;
}

int ms_is(Call& call) {
  const Multistep& method = multistep(call);
  const std::string property = call.string(2, "property");
  const std::vector<std::string> known = {"explicit", "implicit",    "BDF",     "zero-stable",
                                          "A-stable", "A(α)-stable", "L-stable"};
  if (property == known[0]) return call.push(method.is_explicit());
  if (property == known[1]) return call.push(!method.is_explicit());
  if (property == known[2]) return call.push(method.is_bdf());
  if (property == known[3]) return call.push(method.is_zero_stable());
  if (property == known[4]) return call.push(method.alpha_degrees() >= 90);
  if (property == known[5]) return call.push(method.alpha_degrees() > 0);
  if (property == known[6]) return call.push(method.alpha_degrees() >= 90 && method.is_stable_at_infinity());
  throw Error(text("unknown property '", property, "'.", did_you_mean(property, known),
                   " Known are: ", join(known, ", ")));
}

/// The boundary of the stability region as rows (Re z, Im z), ζ = e^{iφ} from 0 to 2π.
int ms_boundary(Call& call) {
  const Multistep& method = multistep(call);
  const long points = call.integer(2, "points", 721);
  if (points < 3 || points > 1000000) throw Error("points must be between 3 and 1000000");
  Mat rows(points, 2);
  for (long i = 0; i < points; ++i) {
    const auto z = method.locus(2 * M_PI * static_cast<double>(i) / static_cast<double>(points - 1));
    rows.row(i) << z.real(), z.imag();
  }
  return push_matrix(call.L, rows);
}

// ── Rosenbrock ────────────────────────────────────────────────────────────────────────────────────────

const Rosenbrock& rosenbrock(Call& call) { return call.object<Rosenbrock>(1, "method"); }

int make_rosenbrock(Call& call) {
  const Options options = call.options(1);
  for (const char* key : {"gamma", "A", "C", "m"})
    if (!options.has(key))
      throw Error(text(key, " is missing; expected { gamma =, A = {…}, C = {…}, m = {…} }"));
  integrate::RosenbrockData data;
  data.name = options.string("name", data.name);
  data.text = options.string("text", "");
  data.cite = options.string("cite", "");
  data.gamma = read_entry(call.L, options.push("gamma"), "gamma");
  data.m = read_list(call.L, options.push("m"), "m");
  const Eigen::Index s = data.m.size();
  data.A = read_rows(call.L, options.push("A"), "A", s, s);
  data.C = read_rows(call.L, options.push("C"), "C", s, s);
  if (options.has("mhat")) data.mhat = read_list(call.L, options.push("mhat"), "mhat");
  if (options.has("dense")) data.dense = read_rows(call.L, options.push("dense"), "dense", -1, s);
  const auto claim = [&](const char* key, std::optional<int>& value) {
    if (options.has(key)) value = static_cast<int>(options.integer(key, 0));
  };
  claim("order", data.order);
  claim("embedded", data.embedded);
  claim("dense_order", data.dense_order);
  claim("dae_order", data.dae_order);
  return call.push(std::make_shared<const Rosenbrock>(std::move(data)));
}

int ros_name(Call& call) { return call.push(rosenbrock(call).name()); }
int ros_note(Call& call) { return call.push(rosenbrock(call).data().text); }
int ros_cite(Call& call) { return call.push(rosenbrock(call).data().cite); }
int ros_stages(Call& call) { return call.push(rosenbrock(call).stages()); }
int ros_gamma(Call& call) { return call.push(rosenbrock(call).gamma()); }
int ros_alpha(Call& call) { return push_matrix(call.L, rosenbrock(call).alpha_matrix()); }
int ros_gammas(Call& call) { return push_matrix(call.L, rosenbrock(call).gamma_matrix()); }
int ros_b(Call& call) { return push_matrix(call.L, Mat(rosenbrock(call).b())); }
int ros_order(Call& call) { return call.push(rosenbrock(call).order()); }
int ros_embedded(Call& call) { return call.push(rosenbrock(call).embedded_order()); }
int ros_dense_order(Call& call) { return call.push(rosenbrock(call).dense_order()); }
int ros_dae_order(Call& call) { return call.push(rosenbrock(call).dae_order()); }
int ros_text(Call& call) { return call.push(rosenbrock(call).str()); }
int ros_report(Call& call) { return call.push(rosenbrock(call).report()); }

// ── families ──

int method_families(Call& call) {
  lua_State* L = call.L;
  const auto set = [L](const char* key, std::string_view value) {
    lua_pushlstring(L, value.data(), value.size());
    lua_setfield(L, -2, key);
  };
  lua_newtable(L);
  for (const integrate::MethodFamily* family : integrate::families()) {
    lua_newtable(L);
    set("name", family->name);
    set("text", family->text);
    set("default", family->default_method);
    for (const auto& [key, value] :
         {std::pair{"listed", family->listed}, std::pair{"explicit", family->is_explicit}}) {
      lua_pushboolean(L, value);
      lua_setfield(L, -2, key);
    }
    if (family->order > 0) {
      lua_pushinteger(L, family->order);
      lua_setfield(L, -2, "order");
    }
    lua_pushboolean(L, family->objection_to_index_2({}).empty());
    lua_setfield(L, -2, "index_2");
    lua_rawseti(L, -2, static_cast<lua_Integer>(lua_rawlen(L, -2)) + 1);
  }
  return 1;
}

const OptionTable multistep_options = {
    {"alpha", "list", "", "α₀ … α_k, the new point first"},
    {"beta", "list", "", "β₀ … β_k"},
    {"name", "string", "", "the name of the method"},
};
const OptionTable rosenbrock_options = {
    {"gamma", "number or string", "", "γ, the diagonal"},
    {"A", "list of lists", "", "aᵢⱼ, below the diagonal"},
    {"C", "list of lists", "", "cᵢⱼ"},
    {"m", "list", "", "the weights"},
    {"mhat", "list", "", "those of the embedded method"},
    {"dense", "list of lists", "", "coefficients of the dense output"},
    {"name", "string", "", "the name of the method"},
    {"text", "string", "", "the use of the method"},
    {"cite", "string", "", "where it comes from"},
    {"order", "integer", "", "a claim, which is proved"},
    {"embedded", "integer", "", "the order of the embedded method"},
    {"dense_order", "integer", "", "the order of the dense output"},
    {"dae_order", "integer", "", "the order on DAEs of index 1"},
};

}  // namespace

extern const Module methods_module = {
    "methods",
    "Multistep and Rosenbrock methods",
    {
        {"method_families", method_families, "method_families() -> { family, … }",
         R"(The families of adaptive methods: name, text, explicit; listed: method = name chooses it; index_2: it
            treats models of index 2 and 3 as they stand; default: the method behind the name; order, where it does
            not vary. See methods().)",
         "#method_families()", "6"},
        {"bdf", bdf, "bdf(steps) -> multistep",
         "The backward differentiation formula with 1 to 6 steps, its coefficients derived exactly.",
         "bdf(2)", R"(
            bdf(2): 2 steps, order 2, implicit

            3/2·xₖ₊₁ - 2·xₖ + 1/2·xₖ₋₁ = Δt fₖ₊₁)"},
        {"multistep", make_multistep, "multistep{ alpha =, beta =, name = } -> multistep",
         R"(A linear multistep method Σ αᵢ xₖ₊₁₋ᵢ = Δt Σ βᵢ fₖ₊₁₋ᵢ from its exact coefficients, the new
            point first.)",
         "multistep{ name = \"adams_bashforth2\", alpha = {1, -1, 0}, "
         "beta = {0, \"3/2\", \"-1/2\"} }:order()",
         "2", &multistep_options},
        {"multistep#name", ms_name, "method.name -> string", "The name of the method.", "", ""},
        {"multistep#steps", ms_steps, "method.steps -> integer", "The number of steps k.", "", ""},
        {"multistep#alpha", ms_alpha, "method.alpha -> column", "Coefficients of xₖ₊₁, xₖ, xₖ₋₁ and so on.",
         "", ""},
        {"multistep#beta", ms_beta, "method.beta -> column", "Coefficients of fₖ₊₁, fₖ, fₖ₋₁ and so on.", "",
         ""},
        {"multistep#error_constant", ms_constant, "method.error_constant -> number",
         "C in the defect C Δt^(p+1) x^(p+1), scaled to σ(1) = 1; exact.", "", ""},
        {"multistep:order", ms_order, "method:order() -> integer", "The order of consistency, exactly.",
         "return bdf(3):order()", "3"},
        {"multistep:is", ms_is, "method:is(property) -> boolean",
         R"("explicit", "implicit", "BDF", "zero-stable", "A-stable", "A(α)-stable" or "L-stable".)",
         R"(return bdf(3):is "A-stable")", "false"},
        {"multistep:stability", ms_stability, "method:stability() -> table",
         "A table: alpha in degrees, real (the left end of the stable interval), zero_stable, A_stable, L_stable.",
         "print(bdf(3):stability())",
         R"(
            zero-stable      yes
            A(α)-stable      α = 86.03°
            A-stable         no
            L-stable         no
            at infinity      stable)"},
        {"multistep:boundary", ms_boundary, "method:boundary([points]) -> matrix",
         "The root locus ρ(ζ)/σ(ζ), |ζ| = 1, which bounds the stability region: rows (Re z, Im z).", R"(
             b = bdf(2):boundary(9)
             b.rows, b(1, 1))",
         "9 0.0"},
        {"multistep:report", ms_report, "method:report() -> string",
         "Formula, order, error constant, zero-stability, linear stability, orders on DAEs.",
         "return bdf(2):report()", ""},
        {"multistep:__tostring", ms_text, "print(method)", "Name, order and the formula.", "", ""},
        {"rosenbrock", make_rosenbrock, "rosenbrock{ gamma =, A =, C =, m =, mhat =, dense = } -> rosenbrock",
         R"(A Rosenbrock method from its coefficients in the form that programs use (Hairer & Wanner II, (7.25)); an
            order that is claimed is proved.)",
         R"(rosenbrock{ gamma = "1/2", A = {{}}, C = {{}}, m = {2} }:order())", "2", &rosenbrock_options},
        {"rosenbrock#name", ros_name, "method.name -> string", "The name of the method.", "", ""},
        {"rosenbrock#text", ros_note, "method.text -> string", "The use of the method.", "", ""},
        {"rosenbrock#cite", ros_cite, "method.cite -> string", "Where the method comes from.", "", ""},
        {"rosenbrock#stages", ros_stages, "method.stages -> integer", "The number of stages.", "", ""},
        {"rosenbrock#gamma", ros_gamma, "method.gamma -> number", "γ, the diagonal of Γ.", "", ""},
        {"rosenbrock#alpha", ros_alpha, "method.alpha -> matrix", "The coefficients αᵢⱼ.", "", ""},
        {"rosenbrock#Gamma", ros_gammas, "method.Gamma -> matrix", "The coefficients γᵢⱼ.", "", ""},
        {"rosenbrock#b", ros_b, "method.b -> column", "The weights.", "", ""},
        {"rosenbrock:order", ros_order, "method:order() -> integer", "The order by rooted trees.",
         "return rosenbrock.rodas4:order()", "4"},
        {"rosenbrock:embedded_order", ros_embedded, "method:embedded_order() -> integer",
         "The order of the embedded method; 0 if there is none.", "rosenbrock.rodas4:embedded_order()", "3"},
        {"rosenbrock:dense_order", ros_dense_order, "method:dense_order() -> integer",
         "The order of the dense output; 0 if there is none.", "rosenbrock.rodas4:dense_order()", "3"},
        {"rosenbrock:dae_order", ros_dae_order, "method:dae_order() -> integer",
         "The order on DAEs of index 1, checked up to 4.", "rosenbrock.rodas4:dae_order()", "4"},
        {"rosenbrock:report", ros_report, "method:report() -> string",
         "Coefficients, orders (ODE, embedded, dense output, index 1), stiff accuracy, work per step.",
         "rosenbrock.ros2:report()", R"(
             ros2: Rosenbrock method, 2 stages, order 2 (embedded 1), γ = 0.29289322

             αᵢⱼ
               1
             γᵢⱼ
                0.292893
               -0.585786  0.292893
             bᵢ
               0.5 0.5

             order            2 by rooted trees: β = α + γ below a vertex with one child, α below one with several
             embedded         order 1, for the error estimate
             index 1          order 2 for x and z
             stiffly accurate no
             work per step    one Jacobian, one factorisation, 2 solves; no Newton iteration, so the Jacobian must be exact)"},
        {"rosenbrock:__tostring", ros_text, "print(method)", "Name, stages and order.", "", ""},
    }};

}  // namespace pendula::lua
