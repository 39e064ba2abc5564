// fit: parameters of a DAE from data. Reads arguments, calls src/sysid/fit/grey_box.
#include <algorithm>
#include <limits>

#include "base/counted.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/bind/integrate/integrate_options.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"
#include "lua/read/inputs.hpp"
#include "sysid/fit/grey_box.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::GreyBoxFit;
using sysid::GreyBoxRequest;

template <>
struct TypeName<GreyBoxFit> {
  static constexpr const char* value = "fit_result";
};

namespace {

std::vector<Expr> everything(const dae::Model& model) {
  std::vector<Expr> known = known_leaves(model);
  known.insert(known.end(), model.parameters.begin(), model.parameters.end());
  return known;
}

/// start = a result of init, or a table of conditions.
void read_start_of(Call& call, const Options& o, GreyBoxRequest& r) {
  lua_State* L = call.L;
  if (!o.has("start")) return;
  const int at = o.push("start");
  if (const auto* held = object_at(L, at, TypeName<dae::ConsistentState>::value)) {
    const auto start = std::static_pointer_cast<const dae::ConsistentState>(*held);
    r.start = start->request;
    r.start.parameters = parameter_overrides(*start);
    r.from = start->t;
  } else if (lua_istable(L, at)) {
    r.start.fix = read_leaf_values(L, at, "start", *r.model);
  } else {
    throw Error(text("start must be a table { x = 1, … } or a result of init, got ", describe(L, at)));
  }
  lua_settop(L, call.count());
}

void read_inputs_of(Call& call, const Options& o, GreyBoxRequest& r) {
  if (o.has("inputs")) {
    const Inputs inputs = read_inputs(o, *r.model, call.L);
    if (!inputs.numeric.empty())
      throw Error(
          "inputs must be expressions in t here; measured inputs come from the data: leave inputs out");
    for (const auto& [leaf, e] : inputs.expressions) r.start.inputs[leaf] = e;
    return;
  }
  std::vector<Expr> leaves;
  for (const Expr u : r.model->inputs)
    if (symbol_of(u).order == 0 && r.start.inputs.count(u) == 0) leaves.push_back(u);
  if (leaves.empty()) return;
  if (static_cast<Index>(leaves.size()) != r.data.inputs()) {
    std::vector<std::string> names;
    for (const Expr u : leaves) names.push_back(to_text(u));
    throw Error(text("the model has the inputs ", join(names, ", "), ", but the data has ",
                     counted(r.data.inputs(), "input")));
  }
  for (std::size_t i = 0; i < leaves.size(); ++i) r.inputs.emplace_back(leaves[i], static_cast<Index>(i));
}

/// The starting value of every parameter: guess, else the model's value, else the start's fix.
void read_guess(Call& call, const Options& o, GreyBoxRequest& r) {
  std::vector<std::pair<Expr, double>> given;
  if (o.has("guess")) given = to_symbol_numbers(call.L, o.push("guess"), "guess", everything(*r.model));
  lua_settop(call.L, call.count());
  r.guess.resize(static_cast<Index>(r.parameters.size()));
  for (std::size_t i = 0; i < r.parameters.size(); ++i) {
    const Expr p = r.parameters[i];
    std::optional<double> value;
    if (const auto v = r.model->values.find(p); v != r.model->values.end())
      value = number_value(v->second);
    else if (symbol_of(p).value)
      value = number_value(*symbol_of(p).value);
    for (const auto& list : {r.start.guess, r.start.fix, given})
      for (const auto& [leaf, number] : list)
        if (leaf == p) value = number;
    if (!value && symbol_of(p).kind != Kind::parameter) value = sysid::first_value(r, p);
    if (!value)
      throw Error(
          text(to_text(p), " has no value to begin with; give guess = { ", symbol_of(p).name, " = … }"));
    r.guess[i] = *value;
  }
  for (const auto& [leaf, number] : given) {
    if (std::find(r.parameters.begin(), r.parameters.end(), leaf) != r.parameters.end()) continue;
    if (symbol_of(leaf).kind == Kind::parameter)
      throw Error(text("guess: ", symbol_of(leaf).name, " is not among params"));
    r.start.guess.emplace_back(leaf, number);
  }
}

/// bounds = { k = {0, 1} }; infinite by default.
void read_bounds(Call& call, const Options& o, GreyBoxRequest& r) {
  if (!o.has("bounds")) return;
  const double infinity = std::numeric_limits<double>::infinity();
  const auto n = static_cast<Index>(r.parameters.size());
  r.bounds = {Vec::Constant(n, -infinity), Vec::Constant(n, infinity)};
  const std::vector<Expr> known = everything(*r.model);
  each_symbol_entry(call.L, o.push("bounds"), "bounds", known, [&](const SymbolEntry& entry) {
    const Vec range = to_numbers(call.L, entry.value, "bounds of " + entry.key());
    if (range.size() != 2 || !(range[0] <= range[1]))
      throw Error(text("bounds: ", entry.key(), " needs { least, largest }"));
    for (const Expr leaf : entry.leaves) {
      const auto found = std::find(r.parameters.begin(), r.parameters.end(), leaf);
      if (found == r.parameters.end()) throw Error(text("bounds: ", entry.key(), " is not among params"));
      r.bounds.lower[found - r.parameters.begin()] = range[0];
      r.bounds.upper[found - r.parameters.begin()] = range[1];
    }
  });
  lua_settop(call.L, call.count());
}

int fit(Call& call) {
  lua_State* L = call.L;
  GreyBoxRequest r;
  r.model = call.shared<dae::Model>(1, "model");
  const Options o = call.options(2);
  for (const char* key : {"params", "data", "y"})
    if (!o.has(key))
      throw Error(text(key, " is missing; write fit(sys, { params = {m}, data = d, y = x, start = {…} })"));
  const auto* held = object_at(L, o.push("data"), TypeName<sysid::IdData>::value);
  if (!held)
    throw Error(text("data must be iddata, got ", describe(L, -1),
                     ": samples at equal steps are data = iddata{ y = { … }, u = { … }, Ts = 0.1 }"));
  r.data = *static_cast<const sysid::IdData*>(held->get());
  r.parameters = to_leaves(L, o.push("params"), "params", everything(*r.model));
  if (r.parameters.empty())
    throw Error("params is empty: name the parameters to estimate, params = { m, L }");
  if (lua_type(L, o.push("y")) == LUA_TSTRING) {
    r.outputs = to_leaves(L, lua_gettop(L), "y", known_leaves(*r.model));
  } else {
    const MatX y = to_matrix(L, lua_gettop(L), "y");
    r.outputs.assign(y.data(), y.data() + y.size());
  }
  lua_settop(L, call.count());
  r.from = o.number("from", 0);
  read_start_of(call, o, r);
  add_declared(r.start, *r.model);
  read_inputs_of(call, o, r);
  read_guess(call, o, r);
  read_bounds(call, o, r);
  const std::string hold = o.string("hold", "zero");
  if (hold != "zero" && hold != "linear")
    throw Error(text("hold: \"zero\" (constant between samples) or \"linear\", got \"", hold, "\""));
  r.hold = hold == "zero";
  r.rtol = o.number("rtol", 1e-8);
  r.atol = o.number("atol", r.rtol * 1e-2);
  if (!(r.rtol > 0) || !(r.atol > 0)) throw Error("rtol and atol must be positive");
  // steps end at the samples, where a held input jumps
  const bool stepped = r.hold && !r.inputs.empty() && !sysid::is_piecewise(*r.model);
  r.dt = o.number("dt", stepped ? r.data.Ts / 2 : 0);
  if (o.has("dt") && !(r.dt > 0)) throw Error(text("dt must be positive, got ", shortest(r.dt)));
  if (o.has("dt") && !r.model->events.empty())
    throw Error("events need steps chosen by the error: leave dt out and give rtol = 1e-8");
  r.method = r.dt > 0 ? integrate::Method{} : read_method(call, o, false);
  r.iterations = static_cast<int>(o.integer("iterations", 100));
  return call.push(std::make_shared<const GreyBoxFit>(sysid::fit(r)));
}

const GreyBoxFit& fit_of(Call& call) { return call.object<GreyBoxFit>(1, "fit_result"); }
int grey_theta(Call& call) { return push_matrix(call.L, Mat(fit_of(call).theta)); }
int deviations(Call& call) { return push_matrix(call.L, Mat(fit_of(call).std)); }
int grey_cov(Call& call) { return push_matrix(call.L, fit_of(call).covariance); }
int grey_names(Call& call) { return push_words(call.L, fit_of(call).names); }
int loss(Call& call) { return call.push(fit_of(call).quality.loss); }
int sigma2(Call& call) { return call.push(fit_of(call).quality.sigma2); }
int fpe(Call& call) { return call.push(fit_of(call).quality.fpe); }
int aic(Call& call) { return call.push(fit_of(call).quality.aic); }
int grey_rank(Call& call) { return call.push(static_cast<long>(fit_of(call).ls.rank)); }
int converged(Call& call) { return call.push(fit_of(call).converged); }
int grey_exact(Call& call) { return call.push(fit_of(call).exact); }
int simulated(Call& call) { return push_matrix(call.L, fit_of(call).simulated); }
int residuals(Call& call) { return push_matrix(call.L, Mat(fit_of(call).residuals)); }
int losses(Call& call) {
  return push_matrix(call.L, Mat(Eigen::Map<const Vec>(fit_of(call).losses.data(),
                                                       static_cast<Index>(fit_of(call).losses.size()))));
}
int iterations(Call& call) { return call.push(static_cast<long>(fit_of(call).losses.size()) - 1); }
int fitted_model(Call& call) { return call.push(fit_of(call).fitted); }
int data(Call& call) { return call.push(std::make_shared<const sysid::IdData>(fit_of(call).request.data)); }
int grey_unidentifiable(Call& call) { return push_words(call.L, fit_of(call).unidentifiable); }
int fit_percent(Call& call) {
  const auto& f = fit_of(call).fit;
  return push_value(call.L, Mat(Eigen::Map<const Vec>(f.data(), static_cast<Index>(f.size()))));
}

int estimate(Call& call) {
  const GreyBoxFit& f = fit_of(call);
  const std::vector<Expr> wanted = to_leaves(call.L, 2, "parameter", everything(*f.request.model));
  Vec values(static_cast<Index>(wanted.size()));
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const auto found = std::find(f.request.parameters.begin(), f.request.parameters.end(), wanted[k]);
    if (found == f.request.parameters.end())
      throw Error(text(to_text(wanted[k]), " was not estimated (params: ", join(f.names, ", "), ")"));
    values[k] = f.theta[found - f.request.parameters.begin()];
  }
  return push_value(call.L, Mat(values));
}

int refit(Call& call) {
  const GreyBoxFit& f = fit_of(call);
  GreyBoxRequest r = f.request;
  const Options o = call.options(2);
  r.guess = f.theta;
  if (o.has("y")) {
    const Mat y = to_data(call.L, o.push("y"), "y");
    if (y.rows() != r.data.y.rows() || y.cols() != r.data.y.cols())
      throw Error(text("y must have the shape of the data, ", r.data.y.rows(), "×", r.data.y.cols(), ", got ",
                       y.rows(), "×", y.cols()));
    r.data.y = y;
  }
  const auto leaves = [&](const char* key) {
    return o.has(key) ? to_symbol_numbers(call.L, o.push(key), key, everything(*r.model))
                      : std::vector<std::pair<Expr, double>>();
  };
  const auto place = [&](const char* key, Expr leaf) {
    const auto at = std::find(r.parameters.begin(), r.parameters.end(), leaf);
    if (at == r.parameters.end()) throw Error(text(key, ": ", to_text(leaf), " was not estimated"));
    return static_cast<Index>(at - r.parameters.begin());
  };
  for (const auto& [leaf, value] : leaves("guess")) r.guess[place("guess", leaf)] = value;
  for (const auto& [leaf, value] : leaves("fixed")) sysid::hold(r, place("fixed", leaf), value);
  lua_settop(call.L, call.count());
  return call.push(std::make_shared<const GreyBoxFit>(sysid::fit(r)));
}

int active(Call& call) {
  std::vector<std::string> names;
  for (const Index i : fit_of(call).active) names.push_back(fit_of(call).names[i]);
  return push_words(call.L, names);
}

int to_text_(Call& call) { return call.push(sysid::describe(fit_of(call))); }

const OptionTable fit_options = {
    {"params", "list of symbols", "", "the parameters to be found; others keep their values", "@parameters"},
    {"data", "iddata", "", "the measurements"},
    {"y", "expression or list", "", "the expressions of the model that the outputs of the data measure",
     "@variables"},
    {"start", "table", "", "a result of init, or the values that are known: { x = 2 }", "@variables"},
    {"guess", "table", "", "where the search begins: { m = 1 }", "@parameters"},
    {"bounds", "table", "", "{ k = {0, 1} }: least and largest value of a parameter", "@parameters"},
    {"inputs", "table", "", "{ [u] = … } as in integrate; else the inputs of the data", "@inputs"},
    {"hold", "string", "\"zero\"", "inputs between samples", "zero|linear"},
    {"method", "string or tableau", "\"auto\"", "of the integration", "@methods"},
    {"dt", "number", "", "fixed steps of this length, in s"},
    {"rtol", "number", "1e-8", "relative tolerance of the integration"},
    {"atol", "number", "1e-10", "absolute tolerance of the integration"},
    {"iterations", "integer", "100", "most steps of Gauss-Newton"},
    {"from", "number", "0", "the time of the first sample, in s"},
};

const OptionTable refit_options = {
    {"fixed", "table", "", "parameters that are held: { k = 0.3 }", "@parameters"},
    {"guess", "table", "", "where the search begins; else at the estimates", "@parameters"},
    {"y", "matrix", "", "other outputs at the same samples; nan is missing"},
};

}  // namespace

extern const Module grey_box_module = {
    "identification",
    "",
    {
        {"fit", fit,
         R"(fit(sys, { params =, data =, y =, start =, guess =, bounds =, inputs =, hold = "zero", method =, dt =,
            rtol = 1e-8 }) -> fit_result)",
         R"(Estimates parameters of a model from data by Gauss–Newton with exact sensitivities. y: the
            expression that was measured, or a list; a state among params stands for its initial value;
            start as in integrate, solved anew for every θ; initial values that it leaves open are
            estimated too; measured inputs are those of the data; several experiments (merge) share the
            parameters and have initial values of their own. The search stays within bounds, and begins at guess, or at the
            values the parameters have.)",
         R"(
            x, k = var "x", param("k", 1)
            sys = dae{ der(x) ~ -k*x }
            y = {}
            for i = 0, 10 do y[i+1] = 2*math.exp(-0.3*i) end
            r = fit(sys, { params = {k}, data = iddata{ y = y, Ts = 1 }, y = x, start = { x = 2 } })
            print(("%.6f"):format(r.theta[1])))",
         "0.300000", &fit_options},
        {"fit_result#theta", grey_theta, "r.theta -> column",
         "The estimates, in the order of params, then the initial values that were open.", "", ""},
        {"fit_result#std", deviations, "r.std -> column", "Their standard deviations.", "", ""},
        {"fit_result#cov", grey_cov, "r.cov -> matrix", "Their covariance σ̂²(JᵀJ)⁻¹.", "", ""},
        {"fit_result#names", grey_names, "r.names -> list", "Their names.", "", ""},
        {"fit_result#loss", loss, "r.loss -> number", "SSE/samples.", "", ""},
        {"fit_result#sigma2", sigma2, "r.sigma2 -> number", "SSE/(samples - rank).", "", ""},
        {"fit_result#fpe", fpe, "r.fpe -> number", "Final prediction error V (1 + d/N)/(1 - d/N).", "", ""},
        {"fit_result#aic", aic, "r.aic -> number", "Akaike's criterion N ln V + 2d.", "", ""},
        {"fit_result#rank", grey_rank, "r.rank -> integer", "Rank of the sensitivities.", "", ""},
        {"fit_result#converged", converged, "r.converged -> boolean", "The steps became negligible.", "", ""},
        {"fit_result#exact", grey_exact, "r.exact -> boolean",
         "The data are reproduced to the accuracy of the integration: there is no noise.", "", ""},
        {"fit_result#fit", fit_percent, "r.fit -> number", "Simulation fit in %, per output.", "", ""},
        {"fit_result#simulated", simulated, "r.simulated -> matrix",
         "The outputs of the fitted model at the samples.", "", ""},
        {"fit_result#residuals", residuals, "r.residuals -> column", "Measured minus simulated.", "", ""},
        {"fit_result#losses", losses, "r.losses -> column", "SSE at the start and after every iteration.", "",
         ""},
        {"fit_result#iterations", iterations, "r.iterations -> integer", "Gauss–Newton iterations.", "", ""},
        {"fit_result#model", fitted_model, "r.model -> model", "The model with the estimated parameters.", "",
         ""},
        {"fit_result#data", data, "r.data -> iddata", "The data.", "", ""},
        {"fit_result#unidentifiable", grey_unidentifiable, "r.unidentifiable -> list",
         "Free combinations in words.", "", ""},
        {"fit_result:refit", refit, "r:refit{ fixed =, guess =, y = } -> fit_result",
         "The same fit once more with some parameters held, from another guess, or to other outputs.",
         R"(
            x, k = var "x", param("k", 1)
            sys = dae{ der(x) ~ -k*x }
            d = iddata{ y = { 1, 0.7, 0.5, 0.36 }, Ts = 1 }
            r = fit(sys, { params = { k, x }, data = d, y = x })
            print(r:refit{ fixed = { x = 1 } }.loss >= r.loss))",
         "true", &refit_options},
        {"fit_result#active", active, "r.active -> list", "The parameters that lie on a bound.", "", ""},
        {"fit_result:__call", estimate, "r(m) -> number", "The estimate of a parameter by symbol or name.",
         R"(
             x, k = var "x", param("k", 1)
             y = {}
             for i = 0, 10 do y[i + 1] = 2*math.exp(-0.3*i) end
             r = fit(dae{ der(x) ~ -k*x }, { params = { k }, data = iddata{ y = y, Ts = 1 }, y = x, start = { x = 2 } })
             print(("%.4f"):format(r(k))))",
         "0.3000"},
        {"fit_result:__tostring", to_text_, "print(r)", "Estimates ± standard deviation, loss, fit.", "", ""},
    }};

}  // namespace pendula::lua
