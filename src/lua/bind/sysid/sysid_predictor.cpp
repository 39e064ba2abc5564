// idpoly and predictors as expressions. Reads arguments, calls src/sysid/model/predictor.
#include "sysid/model/predictor.hpp"

#include "base/counted.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;
using sysid::Predictor;
using sysid::PredictorFit;

struct IdPoly {
  sysid::SymbolicPolynomials p;
  std::vector<std::string> inputs;
  double Ts = 1;
};
template <>
struct TypeName<IdPoly> {
  static constexpr const char* value = "idpoly";
};
template <>
struct TypeName<PredictorFit> {
  static constexpr const char* value = "predictor_fit";
};

namespace {

/// { 1, a1 }, a row or a column as coefficients of q⁰, q⁻¹, …
VecX coefficients(lua_State* L, int index, const std::string& what) {
  const MatX m = to_matrix(L, index, what);
  if (m.size() == 0 || (m.rows() != 1 && m.cols() != 1))
    throw Error(text(what, " must be a list of coefficients { 1, a1, … }"));
  return m.reshaped();
}

VecX monic(Call& call, const Options& o, const char* key) {
  if (!o.has(key)) return VecX::Constant(1, Expr(1));
  const VecX v = coefficients(call.L, o.push(key), key);
  lua_settop(call.L, call.count());
  if (!v[0].is_one())
    throw Error(
        text(key, " must begin with 1: ", key, "(q) = 1 + … q⁻¹ + …, but it begins with ", to_text(v[0])));
  return v;
}

/// One list of coefficients, or a list of such lists (one per input).
std::vector<VecX> per_input(Call& call, const Options& o, const char* key) {
  std::vector<VecX> out;
  if (!o.has(key)) return out;
  lua_State* L = call.L;
  const int list = o.push(key);
  bool nested = false;
  if (lua_istable(L, list)) {
    lua_rawgeti(L, list, 1);
    nested = lua_istable(L, -1) || object_at(L, lua_gettop(L), TypeName<Matrix>::value);
    lua_pop(L, 1);
  }
  if (nested) {
    for (lua_Integer i = 1, n = list_size(L, list, key); i <= n; ++i) {
      lua_rawgeti(L, list, i);
      out.push_back(coefficients(L, lua_gettop(L), text(key, "[", i, "]")));
      lua_pop(L, 1);
    }
  } else {
    out.push_back(coefficients(L, list, key));
  }
  lua_settop(L, call.count());
  return out;
}

VecX delayed(const VecX& b, int nk) {
  if (nk < 0) throw Error(text("nk must not be negative, got ", nk));
  VecX out = VecX::Constant(b.size() + nk, Expr(0));
  out.tail(b.size()) = b;
  return out;
}

const OptionTable idpoly_options = {
    {"A", "list", "{1}", "coefficients of A(q), beginning with 1: A y = B/F u + C/D e"},
    {"B", "list", "", "of B(q); for several inputs a list of lists"},
    {"C", "list", "{1}", "of C(q), beginning with 1"},
    {"D", "list", "{1}", "of D(q), beginning with 1"},
    {"F", "list", "{1}", "of F(q), beginning with 1; for several inputs a list of lists"},
    {"nk", "integer or list", "0", "delay of the inputs, in samples"},
    {"Ts", "number", "1", "the sampling time, in s"},
    {"inputs", "string or list of strings", "", "names of the inputs"},
};

int idpoly(Call& call) {
  const Options o = call.options(1);
  IdPoly m;
  m.p.A = monic(call, o, "A");
  m.p.C = monic(call, o, "C");
  m.p.D = monic(call, o, "D");
  m.p.B = per_input(call, o, "B");
  m.p.F = per_input(call, o, "F");
  if (m.p.F.empty()) m.p.F.assign(m.p.B.size(), VecX::Constant(1, Expr(1)));
  if (m.p.F.size() != m.p.B.size())
    throw Error(text("there are ", m.p.B.size(), " polynomials B but ", m.p.F.size(), " F"));
  for (const VecX& f : m.p.F)
    if (!f[0].is_one()) throw Error(text("F must begin with 1, but it begins with ", to_text(f[0])));
  if (o.has("nk")) {
    std::vector<int> nk = to_whole_numbers(call.L, o.push("nk"), "nk");
    lua_settop(call.L, call.count());
    if (nk.size() == 1) nk.assign(m.p.B.size(), nk[0]);
    if (nk.size() != m.p.B.size())
      throw Error(text("nk: expected ", m.p.B.size(), " numbers, got ", nk.size()));
    for (std::size_t i = 0; i < nk.size(); ++i) m.p.B[i] = delayed(m.p.B[i], nk[i]);
  }
  m.Ts = o.number("Ts", 1);
  if (o.has("inputs")) {
    m.inputs = to_words(call.L, o.push("inputs"), "inputs");
    lua_settop(call.L, call.count());
    if (m.inputs.size() != m.p.B.size()) throw Error(text("inputs: expected ", m.p.B.size(), " names"));
  }
  for (std::size_t i = m.inputs.size(); i < m.p.B.size(); ++i)
    m.inputs.push_back(m.p.B.size() == 1 ? "u" : "u" + std::to_string(i + 1));
  return call.push(std::make_shared<const IdPoly>(std::move(m)));
}

const IdPoly& poly(Call& call) { return call.object<IdPoly>(1, "idpoly"); }

/// The numeric model used by predict and simulate.
sysid::PolyModel numeric(Call& call, const IdData& d) {
  const IdPoly& m = poly(call);
  if (!m.p.numeric()) {
    std::vector<std::string> names;
    for (const Expr q : sysid::predictor(m.p, m.inputs).parameters) names.push_back(to_text(q));
    throw Error(text("the model contains the parameters ", join(names, ", "),
                     "; give numbers, or estimate them: m:predictor():fit(d)"));
  }
  if (d.inputs() != static_cast<Index>(m.p.B.size()))
    throw Error(text("the model has ", counted(m.p.B.size(), "input"), ", the data ", d.inputs()));
  sysid::PolyModel out;
  out.kind = m.p.class_name();
  out.p = m.p.values();
  out.y_name = d.y_names[0];
  out.u_names = d.u_names;
  out.Ts = m.Ts;
  return out;
}

const OptionTable response_options = {
    {"horizon", "integer", "", "steps ahead; 0: simulation"},
    {"ic", "string", "\"zero\"", "the state before the first sample", "data|zero|estimate"},
    {"init", "string", "", "the name of ic in earlier versions", "data|zero|estimate"},
};

int push_response(Call& call, Index fallback) {
  const IdPoly& m = poly(call);
  const auto inputs = static_cast<Index>(m.p.B.size());
  const SimulationData of = fallback == 0 ? simulation_data(call, inputs, 1, m.Ts)
                                          : SimulationData{call.object<IdData>(2, "data"), false};
  const IdData& d = of.data;
  Index horizon = fallback;
  sysid::Seed seed = sysid::Seed::zero;
  if (call.has(3) && lua_istable(call.L, 3)) {
    const Options o = call.options(3);
    horizon = o.integer("horizon", horizon);
    seed = read_seed(o, seed);
  } else if (call.has(3)) {
    horizon = call.integer(3, "horizon");
  }
  if (of.inputs_alone && (seed != sysid::Seed::zero || horizon != 0))
    throw Error("inputs alone have no measured outputs: write m:simulate(u), which starts from rest");
  return push_matrix(call.L, Mat(sysid::predict(numeric(call, d), d, horizon, seed).values));
}
int poly_predict(Call& call) { return push_response(call, 1); }
int poly_simulate(Call& call) { return push_response(call, 0); }

int poly_predictor(Call& call) {
  const IdPoly& m = poly(call);
  return call.push(std::make_shared<const Predictor>(sysid::predictor(m.p, m.inputs)));
}
int poly_derivation(Call& call) {
  const IdPoly& m = poly(call);
  return call.push(sysid::describe(m.p, m.inputs) + "\n  " + sysid::derivation(m.p) + "\n" +
                   sysid::describe(sysid::predictor(m.p, m.inputs)));
}
int poly_text(Call& call) { return call.push(sysid::describe(poly(call).p, poly(call).inputs)); }
int poly_kind(Call& call) { return call.push(poly(call).p.class_name()); }

template <VecX sysid::SymbolicPolynomials::*member>
int poly_field(Call& call) {
  return push_matrix(call.L, MatX((poly(call).p.*member).transpose()));
}
template <std::vector<VecX> sysid::SymbolicPolynomials::*member>
int poly_list(Call& call) {
  const std::vector<VecX>& list = poly(call).p.*member;
  if (list.size() == 1) return push_matrix(call.L, MatX(list[0].transpose()));
  lua_createtable(call.L, static_cast<int>(list.size()), 0);
  for (std::size_t i = 0; i < list.size(); ++i) {
    push_matrix(call.L, MatX(list[i].transpose()));
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(i + 1));
  }
  return 1;
}

// ── predictors ──

int predictor(Call& call) {
  const Expr e = to_expr(call.L, 1, "the prediction");
  std::vector<Expr> parameters;
  if (call.has(2)) parameters = to_leaves(call.L, 2, "parameters", declared_symbols());
  return call.push(std::make_shared<const Predictor>(sysid::predictor(e, parameters)));
}

const Predictor& predictor_of(Call& call) { return call.object<Predictor>(1, "predictor"); }
int expression(Call& call) { return push_expr(call.L, predictor_of(call).expression); }
int is_linear(Call& call) { return call.push(predictor_of(call).linear); }
int is_recursive(Call& call) { return call.push(predictor_of(call).recursive); }
int predictor_regressor(Call& call) {
  const Predictor& p = predictor_of(call);
  if (!p.linear) throw Error("the predictor is not linear in θ: it has no regressor");
  return push_matrix(call.L, MatX(p.regressor));
}
int offset(Call& call) {
  return push_expr(call.L, predictor_of(call).linear ? predictor_of(call).offset : Expr(0));
}
int parameters(Call& call) { return push_matrix(call.L, MatX(column(predictor_of(call).parameters))); }
int predictor_text(Call& call) { return call.push(sysid::describe(predictor_of(call)).substr(2)); }

int latex(Call& call) { return call.push("\\hat y(t) = " + to_latex(predictor_of(call).expression)); }

const OptionTable predictor_options = {
    {"start", "list or table", "", "θ to begin with: a list, or { a = 0.5 }"},
    {"ic", "string", "\"drop\"", "treatment of the samples before the first", "drop|zero|estimate"},
    {"noise", "density or function", "", "maximum likelihood: gaussian(s), laplace(s), uniform(a, b)"},
};

int fit_predictor(Call& call) {
  const Predictor& p = predictor_of(call);
  const IdData& d = call.object<IdData>(2, "data");
  const Options o = call.options(3);
  Vec theta = Vec::Zero(static_cast<Index>(p.parameters.size()));
  for (std::size_t i = 0; i < p.parameters.size(); ++i)
    if (const auto& value = symbol_of(p.parameters[i]).value) theta[i] = number_value(*value).value_or(0);
  if (o.has("start")) {
    const int at = o.push("start");
    bool keyed = false;
    if (lua_istable(call.L, at)) {
      lua_rawgeti(call.L, at, 1);
      keyed = lua_isnil(call.L, -1);
      lua_pop(call.L, 1);
    }
    if (keyed) {
      for (const auto& [leaf, value] : to_symbol_numbers(call.L, at, "start", p.parameters))
        for (std::size_t i = 0; i < p.parameters.size(); ++i)
          if (p.parameters[i] == leaf) theta[i] = value;
    } else {
      const Vec given = to_data(call.L, at, "start").reshaped();
      if (given.size() != theta.size())
        throw Error(text("start: expected ", theta.size(), " numbers, got ", given.size()));
      theta = given;
    }
    lua_settop(call.L, call.count());
  }
  const sysid::InitialCondition ic = sysid::initial_condition_named(o.string("ic", "drop"));
  const auto noise = read_noise(call, o);
  if (noise && noise->kind == sysid::Density::Kind::uniform)
    return push_parameter_set(call, sysid::regression(p, d, ic), *noise);
  return call.push(std::make_shared<const PredictorFit>(sysid::fit(p, d, ic, theta, noise.get())));
}

const PredictorFit& fitted(Call& call) { return call.object<PredictorFit>(1, "predictor_fit"); }
int fit_iterates(Call& call) { return push_matrix(call.L, fitted(call).iterates); }
int fit_losses(Call& call) { return push_matrix(call.L, Mat(fitted(call).losses)); }
int fit_theta(Call& call) { return push_matrix(call.L, Mat(fitted(call).theta)); }
int fit_std(Call& call) {
  if (fitted(call).std.size() == 0)
    throw Error("this estimate has no standard deviation: it lies in a corner of the feasible set");
  return push_matrix(call.L, Mat(fitted(call).std));
}
int fit_cov(Call& call) {
  if (fitted(call).covariance.size() == 0)
    throw Error("this estimate has no covariance: it lies in a corner of the feasible set");
  return push_matrix(call.L, fitted(call).covariance);
}
int fit_rank(Call& call) { return call.push(static_cast<long>(fitted(call).ls.rank)); }
int fit_loss(Call& call) { return call.push(fitted(call).quality.loss); }
int fit_sigma2(Call& call) { return call.push(fitted(call).quality.sigma2); }
int predictor_fit_percent(Call& call) { return call.push(fitted(call).quality.fit); }
int fit_residuals(Call& call) { return push_matrix(call.L, Mat(fitted(call).residuals)); }
int fit_predictions(Call& call) { return push_matrix(call.L, Mat(fitted(call).predictions)); }
int fit_log_likelihood(Call& call) { return call.push(fitted(call).log_likelihood); }
int fit_free(Call& call) { return push_words(call.L, fitted(call).unidentifiable); }
int fit_text(Call& call) { return call.push(sysid::describe(fitted(call))); }

}  // namespace

extern const Module predictor_module = {
    "identification",
    "",
    {
        {"idpoly", idpoly, "idpoly{ A =, B =, C =, D =, F =, nk = 0, Ts = 1 } -> idpoly",
         R"(The model A(q) y = B(q)/F(q) u + C(q)/D(q) e with numbers or symbols as coefficients of 1, q⁻¹,
            …; B and F of several inputs are lists of lists.)",
         R"(
            a1, b0 = params "a1 b0"
            print(idpoly{ A = {1, a1}, B = {b0} }))",
         R"(
            ARX model
              A(q) = 1 + a₁ q⁻¹
              B(q) = b₀)",
         &idpoly_options},
        {"idpoly:predictor", poly_predictor, "m:predictor() -> predictor",
         R"(The one-step predictor from H ŷ = G u + (H - 1) y, whether it is linear in the parameters, and
            its regressor.)",
         R"(
            a1, b0 = params "a1 b0"
            print(idpoly{ A = {1, a1}, B = {b0} }:predictor()))",
         R"(
            ŷ(t) = b₀ u(t) - a₁ y(t - 1)
              linear in θ = (a₁, b₀): ŷ(t) = φ(t)ᵀθ with φ(t) = [-y(t - 1), u(t)]ᵀ
              least squares is a linear problem: ΦᵀΦ θ̂ = Φᵀ y; covariance σ²(ΦᵀΦ)⁻¹ if Φ has full rank)"},
        {"idpoly:derivation", poly_derivation, "m:derivation() -> string", "The predictor step by step.",
         R"(
            b1, f1 = params "b1 f1"
            print(idpoly{ B = {0, b1}, F = {1, f1} }:derivation()))",
         R"(
            OE model
              B(q) = b₁ q⁻¹
              F(q) = 1 + f₁ q⁻¹
              H ŷ = G u + (H - 1) y with G = B/F, H = 1
              multiplied out: F ŷ = B u
              ŷ(t) = b₁ u(t - 1) - f₁ ŷ(t - 1)
              not linear in θ = (b₁, f₁): earlier predictions ŷ(t-k) depend on θ themselves
              least squares is a nonlinear problem (Gauss–Newton))"},
        {"idpoly:predict", poly_predict,
         R"(m:predict(d [, horizon | { horizon = 1, ic = "zero" }]) -> column)",
         "ŷ(t|t-horizon) of a model with numbers.",
         "print(idpoly{ A = {1, -0.5}, B = {1} }:predict(iddata{ y = {1, 2, 3}, u = {1, 1, 1} }).T)",
         "1  1.5  2", &response_options},
        {"idpoly:simulate", poly_simulate, R"(m:simulate(d | u [, { ic = "zero" }]) -> column)",
         "The output from the input alone: that of data, or a list or matrix u.",
         "print(idpoly{ A = {1, -0.5}, B = {1} }:simulate(iddata{ y = {0, 0, 0}, u = {1, 1, 1} }).T)",
         "1  1.5  1.75", &response_options},
        {"idpoly#kind", poly_kind, "m.kind -> string", "ARX, ARMAX, OE, BJ and so on.", "", ""},
        {"idpoly#A", poly_field<&sysid::SymbolicPolynomials::A>, "m.A -> row", "Coefficients of A(q).", "",
         ""},
        {"idpoly#B", poly_list<&sysid::SymbolicPolynomials::B>, "m.B -> row",
         "Coefficients of B(q); several inputs: a list.", "", ""},
        {"idpoly#C", poly_field<&sysid::SymbolicPolynomials::C>, "m.C -> row", "Coefficients of C(q).", "",
         ""},
        {"idpoly#D", poly_field<&sysid::SymbolicPolynomials::D>, "m.D -> row", "Coefficients of D(q).", "",
         ""},
        {"idpoly#F", poly_list<&sysid::SymbolicPolynomials::F>, "m.F -> row",
         "Coefficients of F(q); several inputs: a list.", "", ""},
        {"idpoly:__tostring", poly_text, "print(m)", "The polynomials.", "", ""},
        {"predictor", predictor, "predictor(expression [, parameters]) -> predictor",
         R"(A predictor ŷ(t) written out: y(t-1), u(t-2) with y = func "y", u = func "u"; yhat(t-1) is an
            earlier prediction, e(t-1) an earlier error. Says whether it is linear in the parameters.)",
         R"(
            y, u = func "y", func "u"
            a, b = params "a b"
            p = predictor(a*y(t-1) + b*u(t-1))
            p.linear, p.regressor[1])",
         "true y(t - 1)"},
        {"predictor:fit", fit_predictor, R"(p:fit(d [, { start =, ic = "drop", noise = }]) -> predictor_fit)",
         R"(Its parameters by least squares: one linear problem, or Gauss–Newton with the exact gradient of
            the recursion. noise: maximum likelihood for that density (linear predictors); uniform(low,
            high) gives the set.)",
         R"(
            y, u = func "y", func "u"
            a, b = params "a b"
            print(predictor(a*y(t-1) + b*u(t-1)):fit(iddata{ y = {0, 1}, u = {1, 0} }).theta.T))",
         "0  1", &predictor_options},
        {"predictor:estimate", fit_predictor, "p:estimate(d [, options]) -> predictor_fit",
         "The same as p:fit.",
         "y = func 'y'  a = param 'a'\n"
         "print(predictor(a*y(t-1)):estimate(iddata{ y = {8, 4, 2} }).theta.T)",
         "0.5", &predictor_options},
        {"predictor#expression", expression, "p.expression -> expression", "ŷ(t).", "", ""},
        {"predictor#linear", is_linear, "p.linear -> boolean", "Linear in the parameters.", "", ""},
        {"predictor#recursive", is_recursive, "p.recursive -> boolean", "Earlier predictions enter.", "", ""},
        {"predictor#regressor", predictor_regressor, "p.regressor -> column",
         "φ(t) with ŷ(t) = offset + φ(t)ᵀθ.", "", ""},
        {"predictor#offset", offset, "p.offset -> expression", "The part of ŷ(t) without parameters.", "",
         ""},
        {"predictor#parameters", parameters, "p.parameters -> column", "θ.", "", ""},
        {"predictor:latex", latex, "p:latex() -> string", "LaTeX of ŷ(t).",
         R"(
            y = func "y"  a = param "a"
            print(predictor(a*y(t-1)):latex()))",
         ""},
        {"predictor:__tostring", predictor_text, "print(p)",
         "The predictor, its regressor, and the kind of problem.", "", ""},
        {"predictor_fit#theta", fit_theta, "f.theta -> column", "The estimate.", "", ""},
        {"predictor_fit#iterates", fit_iterates, "f.iterates -> matrix",
         "θ at the start and after every iteration of Gauss–Newton, one per row.", "", ""},
        {"predictor_fit#losses", fit_losses, "f.losses -> column", "SSE of the iterates.", "", ""},
        {"predictor_fit#std", fit_std, "f.std -> column", "Standard deviations; inf where not identifiable.",
         "", ""},
        {"predictor_fit#cov", fit_cov, "f.cov -> matrix", "Covariance.", "", ""},
        {"predictor_fit#rank", fit_rank, "f.rank -> integer", "Rank of the gradient.", "", ""},
        {"predictor_fit#loss", fit_loss, "f.loss -> number", "SSE/rows.", "", ""},
        {"predictor_fit#sigma2", fit_sigma2, "f.sigma2 -> number", "SSE/(rows - rank).", "", ""},
        {"predictor_fit#fit_percent", predictor_fit_percent, "f.fit_percent -> number", "One-step fit in %.",
         "", ""},
        {"predictor_fit#residuals", fit_residuals, "f.residuals -> column", "y - ŷ at the rows used.", "",
         ""},
        {"predictor_fit#predictions", fit_predictions, "f.predictions -> column", "ŷ at the rows used.", "",
         ""},
        {"predictor_fit#log_likelihood", fit_log_likelihood, "f.log_likelihood -> number",
         "With noise = …: ln L at θ.", "", ""},
        {"predictor_fit#unidentifiable", fit_free, "f.unidentifiable -> list", "Free combinations in words.",
         "", ""},
        {"predictor_fit:__tostring", fit_text, "print(f)", "Estimate, loss, fit, rank.", "", ""},
    }};

}  // namespace pendula::lua
