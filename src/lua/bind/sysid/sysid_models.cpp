// arx, fir, armax, oe, bj, pem. Reads arguments, calls src/sysid.
#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"
#include "sysid/fit/instrumental.hpp"
#include "sysid/fit/pem.hpp"
#include "sysid/fit/regularised_arx.hpp"
#include "sysid/fit/state_space_pem.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;
using sysid::IdModel;

namespace {

/// An order option as one row per output: a number, a list (per input), or a matrix (outputs × inputs).
std::vector<int> order_row(Call& call, const Options& o, const char* key, Index output, Index outputs,
                           int fallback, bool one_per_output = false) {
  if (!o.has(key)) return {fallback};
  const Mat m = to_data(call.L, o.push(key), key);
  lua_settop(call.L, call.count());
  for (const double v : m.reshaped())
    if (v != std::round(v))
      throw Error(text(key, " must be a whole number, got ", shortest(v)));
    else if (!(std::abs(v) < 1e6))
      throw Error(text(key, " = ", shortest(v), " is more than data can determine (at most 999999)"));
  std::vector<int> out;
  // Rows are outputs. nb = {{1}, {1}} for one input is a matrix as well, whereas {1, 1} lists two inputs.
  const bool per_output = m.cols() > 1 || one_per_output;
  if (per_output && m.rows() == outputs && outputs > 1) {
    for (const double v : m.row(output)) out.push_back(static_cast<int>(v));
  } else {
    for (const double v : m.reshaped()) out.push_back(static_cast<int>(v));
  }
  return out;
}

}  // namespace

sysid::Orders read_orders(Call& call, const Options& o, const IdData& d, Index output) {
  sysid::Orders orders;
  const Index ny = d.outputs();
  const auto single = [&](const char* key) {
    const std::vector<int> row = order_row(call, o, key, output, ny, 0);
    if (row.size() != 1) throw Error(text(key, " must be one whole number, got ", row.size()));
    return row[0];
  };
  orders.nc = single("nc");
  orders.nd = single("nd");
  const std::vector<int> na = order_row(call, o, "na", output, ny, 0);
  if (na.size() != 1 && static_cast<Index>(na.size()) != ny)
    throw Error(text("na must be one whole number", ny > 1 ? text(" or a ", ny, "×", ny, " matrix") : "",
                     ", got ", na.size(), " numbers"));
  orders.na = na.size() == 1 ? na[0] : na[output];
  if (d.inputs() == 0) {
    for (const char* key : {"nb", "nf"})
      if (o.has(key)) throw Error(text(key, " is given, but the data has no input u"));
    return sysid::checked(orders, d);
  }
  orders.nb = order_row(call, o, "nb", output, ny, 0, d.inputs() == 1);
  orders.nk = order_row(call, o, "nk", output, ny, 1, d.inputs() == 1);
  orders.nf = order_row(call, o, "nf", output, ny, 0, d.inputs() == 1);
  return sysid::checked(orders, d);
}

namespace {

/// couplings[j]: past values of output j in the equation of `output`.
std::vector<int> read_coupling(Call& call, const Options& o, const IdData& d, Index output) {
  std::vector<int> row = order_row(call, o, "na", output, d.outputs(), 0);
  if (row.size() == 1) row.assign(static_cast<std::size_t>(d.outputs()), row[0]);
  for (const int v : row)
    if (v < 0) throw Error(text("na must not be negative, got ", v));
  return row;
}

/// ic = "drop" …, also written start = "drop".
sysid::InitialCondition read_ic(Call& call, const Options& o, const char* fallback) {
  if (o.has("ic") || !o.has("start")) return sysid::initial_condition_named(o.string("ic", fallback));
  const bool word = lua_type(call.L, o.push("start")) == LUA_TSTRING;
  lua_settop(call.L, call.count());
  return sysid::initial_condition_named(word ? o.string("start") : fallback);
}

/// weights = or covariance =: one model with one output.
int estimate_weighted(Call& call, const Options& o, const sysid::Orders& orders,
                      sysid::InitialCondition start) {
  const IdData& d = call.object<IdData>(1, "data");
  if (o.has("noise") || (o.has("weights") && o.has("covariance")))
    throw Error("give one of noise, covariance and weights (weights = 1/variance)");
  if (d.outputs() > 1) throw Error("weights are for data with one output; take one: d:select{ y = 1 }");
  sysid::Weighting w;
  if (o.has("weights")) w.weights = to_data(call.L, o.push("weights"), "weights").reshaped();
  if (o.has("covariance")) w.covariance = to_data(call.L, o.push("covariance"), "covariance");
  lua_settop(call.L, call.count());
  IdModel m;
  m.inputs = d.inputs();
  m.outputs.push_back(sysid::arx(d, 0, orders, start, std::move(w)));
  return call.push(std::make_shared<const IdModel>(std::move(m)));
}

/// kernel = "TC" or "DC": one model with one output.
int estimate_regularised(Call& call, const Options& o, const sysid::Orders& orders,
                         sysid::InitialCondition start) {
  const IdData& d = call.object<IdData>(1, "data");
  for (const char* key : {"noise", "weights", "covariance", "start"})
    if (o.has(key)) throw Error(text("give kernel or ", key, ", not both"));
  if (d.outputs() > 1) throw Error("kernels are for data with one output; take one: d:select{ y = 1 }");
  if (start == sysid::InitialCondition::estimate) throw Error("with a kernel ic is \"drop\" or \"zero\"");
  IdModel m;
  m.inputs = d.inputs();
  m.outputs.push_back(sysid::regularised_arx(d, 0, orders, start, sysid::kernel_named(o.string("kernel"))));
  return call.push(std::make_shared<const IdModel>(std::move(m)));
}

int estimate_arx(Call& call, const Options& o) {
  const IdData& d = call.object<IdData>(1, "data");
  std::vector<sysid::Orders> orders;
  std::vector<std::vector<int>> couplings;
  for (Index i = 0; i < d.outputs(); ++i) {
    orders.push_back(read_orders(call, o, d, i));
    couplings.push_back(read_coupling(call, o, d, i));
  }
  const sysid::InitialCondition start = read_ic(call, o, "drop");
  if (o.has("kernel")) return estimate_regularised(call, o, orders[0], start);
  if (o.has("weights") || o.has("covariance")) return estimate_weighted(call, o, orders[0], start);
  if (const auto noise = read_noise(call, o)) {
    if (d.outputs() > 1)
      throw Error("noise densities are for data with one output; take one: d:select{ y = 1 }");
    if (noise->kind == sysid::Density::Kind::uniform)
      return push_parameter_set(call, sysid::regression(d, 0, orders[0], start), *noise);
    IdModel m;
    m.inputs = d.inputs();
    m.outputs.push_back(sysid::arx(d, 0, orders[0], start, *noise));
    return call.push(std::make_shared<const IdModel>(std::move(m)));
  }
  return call.push(std::make_shared<const IdModel>(sysid::arx(d, orders, couplings, start)));
}

int arx(Call& call) {
  call.object<IdData>(1, "data");
  call.table(2, "orders");
  return estimate_arx(call, call.options(2));
}

int iv4(Call& call) {
  const IdData& d = call.object<IdData>(1, "data");
  call.table(2, "orders");
  const Options o = call.options(2);
  IdModel m;
  m.inputs = d.inputs();
  for (Index i = 0; i < d.outputs(); ++i) m.outputs.push_back(sysid::iv4(d, i, read_orders(call, o, d, i)));
  return call.push(std::make_shared<const IdModel>(std::move(m)));
}

int fir(Call& call) {
  call.object<IdData>(1, "data");
  call.table(2, "orders");
  const Options o = call.options(2);
  if (!o.has("nb")) throw Error("nb is missing: the number of coefficients, fir(d, { nb = 10, nk = 1 })");
  return estimate_arx(call, o);
}

/// Φ and y of the least-squares problem that arx solves.
int regressor(Call& call) {
  const IdData& d = call.object<IdData>(1, "data");
  call.table(2, "orders");
  const Options o = call.options(2);
  if (d.outputs() > 1) throw Error("the regressor is for data with one output; take one: d:select{ y = 1 }");
  const sysid::Regression r = sysid::regression(d, 0, read_orders(call, o, d, 0), read_ic(call, o, "drop"));
  push_matrix(call.L, r.Phi);
  push_matrix(call.L, Mat(r.y));
  push_words(call.L, r.names);
  return 3;
}

/// Prediction-error models: one search per output.
int estimate_pem(Call& call, const Options& o, const char* kind) {
  const IdData& d = call.object<IdData>(1, "data");
  sysid::PemOptions options;
  options.start = read_ic(call, o, "estimate");
  options.iterations = static_cast<int>(o.integer("iterations", 200));
  if (o.has("start") && lua_type(call.L, o.push("start")) != LUA_TSTRING) {
    if (d.outputs() > 1) throw Error("start is for models with one output");
    options.theta = Vec(to_data(call.L, o.push("start"), "start").reshaped());
    lua_settop(call.L, call.count());
  }
  const auto noise = read_noise(call, o);
  IdModel m;
  m.inputs = d.inputs();
  for (Index i = 0; i < d.outputs(); ++i)
    m.outputs.push_back(noise ? sysid::pem(d, i, read_orders(call, o, d, i), kind, options, *noise)
                              : sysid::pem(d, i, read_orders(call, o, d, i), kind, options));
  return call.push(std::make_shared<const IdModel>(std::move(m)));
}

void check_estimation(Call& call) {
  call.object<IdData>(1, "data");
  call.table(2, "orders");
}

int armax(Call& call) {
  check_estimation(call);
  const Options o = call.options(2);
  return estimate_pem(call, o, call.object<IdData>(1, "data").inputs() > 0 ? "ARMAX" : "ARMA");
}

int oe(Call& call) {
  check_estimation(call);
  return estimate_pem(call, call.options(2), "OE");
}

int bj(Call& call) {
  check_estimation(call);
  return estimate_pem(call, call.options(2), "BJ");
}

const OptionTable refined_options = {
    {"iterations", "integer", "100", "most iterations of Gauss-Newton"},
};

int pem(Call& call) {
  if (call.is<IdModel>(2)) {
    const IdModel& m = call.object<IdModel>(2, "model");
    const auto iterations = static_cast<int>(call.options(3, refined_options).integer("iterations", 100));
    if (!m.state_space)
      throw Error("pem(d, mod) refines state-space models; give orders: pem(d, { na = …, nb = … })");
    const IdData& d = call.object<IdData>(1, "data");
    return call.push(std::make_shared<const IdModel>(sysid::refined(*m.state_space, d, iterations)));
  }
  check_estimation(call);
  return estimate_pem(call, call.options(2), "polynomial");
}

int model_text(Call& call) { return call.push(sysid::describe(idmodel_of(call))); }

// ── options: the orders, and what the estimators share ──

const OptionRow na_row{"na", "integer or list", "", "past outputs: coefficients of A(q)"};
const OptionRow nb_row{"nb", "integer or list", "",
                       "past inputs: coefficients of B(q), one number per input"};
const OptionRow nc_row{"nc", "integer", "", "coefficients of C(q), the colour of the noise"};
const OptionRow nd_row{"nd", "integer", "", "coefficients of D(q), the poles of the noise"};
const OptionRow nf_row{"nf", "integer or list", "", "coefficients of F(q), the poles of the inputs"};
const OptionRow nk_row{"nk", "integer or list", "1", "delay of the inputs, in samples"};
const OptionRow ic_regression_row{"ic", "string", "\"drop\"", "treatment of the samples before the first",
                                  "drop|zero|estimate"};
const OptionRow ic_filter_row{"ic", "string", "\"estimate\"", "treatment of the samples before the first",
                              "drop|zero|estimate"};
const OptionRow noise_row{"noise", "density or function", "",
                          "maximum likelihood: gaussian(s), laplace(s), uniform(a, b)"};
const OptionRow kernel_row{"kernel", "string", "", "regularised: impulse responses smooth and decaying",
                           "TC|DC"};
const OptionRow weights_row{"weights", "column", "", "1/variance of each row"};
const OptionRow covariance_row{"covariance", "matrix", "", "of the noise"};
const OptionRow start_row{"start", "column or string", "", "θ to begin with; else linear estimates"};
const OptionRow iterations_row{"iterations", "integer", "", "most steps of Gauss-Newton"};

const OptionTable arx_options{na_row,     nb_row,      nk_row,         ic_regression_row, noise_row,
                              kernel_row, weights_row, covariance_row, start_row};
const OptionTable iv4_options{na_row, nb_row, nk_row};
const OptionTable fir_options{nb_row,     nk_row,      ic_regression_row, noise_row,
                              kernel_row, weights_row, covariance_row,    start_row};
const OptionTable regressor_options{na_row, nb_row, nk_row, ic_regression_row, start_row};
const OptionTable armax_options{na_row,        nb_row,    nc_row,         nk_row,
                                ic_filter_row, start_row, iterations_row, noise_row};
const OptionTable oe_options{nb_row, nf_row, nk_row, ic_filter_row, start_row, iterations_row, noise_row};
const OptionTable bj_options{nb_row,        nc_row,    nd_row,         nf_row,   nk_row,
                             ic_filter_row, start_row, iterations_row, noise_row};
const OptionTable pem_options{na_row, nb_row,        nc_row,    nd_row,         nf_row,
                              nk_row, ic_filter_row, start_row, iterations_row, noise_row};

}  // namespace

extern const Module idmodel_module = {
    "identification",
    "",
    {
        {"arx", arx,
         R"(arx(d, { na =, nb =, nk = 1, ic = "drop", noise =, weights =, covariance = }) -> idmodel)",
         R"(Least-squares estimate of A(q) y(t) = B(q) u(t) + e(t): na past outputs, nb past inputs after a
            delay of nk samples; b_k multiplies u(t-k). Several inputs: lists nb, nk; several outputs:
            matrices. ic: the samples before the first one; "drop" the rows that need them, "zero" or
            "estimate" them. noise: maximum likelihood for that density; uniform(low, high) gives the set of
            parameters. weights (1/variance) or the covariance of the noise: weighted least squares. kernel
            = "TC" or "DC": long models with a prior that impulse responses are smooth and decay, its
            hyperparameters by empirical Bayes.)",
         R"(
            d = iddata{ y = {0, 1, .6, -.7, 1.5, 1.9}, u = {1, 0, -1, 2, 1, 0} }
            m = arx(d, { na = 1, nb = 1, nk = 1 })
            print(m.theta.T))",
         "-0.6031634446  0.985940246", &arx_options},
        {"iv4", iv4, "iv4(d, { na =, nb =, nk = 1 }) -> idmodel",
         R"(An ARX model by instrumental variables in four steps: consistent whatever the colour of the noise,
            where arx is biased; the input must not depend on the noise (no feedback).)",
         R"(
            u, y = {}, {}
            for t = 1, 40 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-1] or 0) end
            print(("%.6f"):format(iv4(iddata{ y = y, u = u }, { na = 1, nb = 1 }).theta[1])))",
         "-0.500000", &iv4_options},
        {"fir", fir, R"(fir(d, { nb =, nk = 1, ic = "drop" }) -> idmodel)",
         "Least-squares estimate of the impulse response y(t) = Σ b_k u(t-k) + e(t).",
         "print(fir(iddata{ y = {0, 2, 1, 4}, u = {1, 0.5, 2, 1} }, { nb = 1 }).theta)", "2", &fir_options},
        {"regressor", regressor, R"(regressor(d, { na =, nb =, nk = 1, ic = "drop" }) -> Phi, y, names)",
         R"(The matrix Φ with the rows φ(t)ᵀ = [-y(t-1) … u(t-nk) …], the outputs y(t) it explains, and the
            names of its columns: the least-squares problem of arx, for lsq or to inspect it.)",
         R"(
            Phi, y = regressor(iddata{ y = {0, 1}, u = {1, 0} }, { na = 1, nb = 1 })
            print(Phi, y))",
         "0  1 1", &regressor_options},
        {"armax", armax, R"(armax(d, { na =, nb =, nc =, nk = 1, ic = "estimate", start = }) -> idmodel)",
         R"(Prediction-error estimate of A(q) y(t) = B(q) u(t) + C(q) e(t) by Gauss–Newton with exact
            gradients; without inputs an ARMA model. start: θ to begin with; otherwise linear estimates.
            noise: maximum likelihood for gaussian(), laplace() or a density of one's own, also in oe, bj
            and pem.)",
         R"(
            u, y = {}, {}
            for t = 1, 40 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-1] or 0) end
            m = armax(iddata{ y = y, u = u }, { na = 1, nb = 1, nc = 1 })
            print(("%.6f %.6f"):format(m.theta[1], m.theta[2])))",
         "-0.500000 1.000000", &armax_options},
        {"oe", oe, R"(oe(d, { nb =, nf =, nk = 1, ic = "estimate", start = }) -> idmodel)",
         "Output-error estimate y(t) = B(q)/F(q) u(t) + e(t): the model that simulates best.",
         R"(
            u, y = {}, {}
            for t = 1, 40 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-1] or 0) end
            m = oe(iddata{ y = y, u = u }, { nb = 1, nf = 1 })
            print(("%.6f %.6f"):format(m.theta[1], m.theta[2])))",
         "1.000000 -0.500000", &oe_options},
        {"bj", bj, R"(bj(d, { nb =, nc =, nd =, nf =, nk = 1, ic = "estimate", start = }) -> idmodel)",
         "Box–Jenkins estimate y(t) = B(q)/F(q) u(t) + C(q)/D(q) e(t).",
         R"(
            u, y = {}, {}
            for t = 1, 80 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-1] or 0) end
            m = bj(iddata{ y = y, u = u }, { nb = 1, nf = 1, nc = 0, nd = 1 })
            print(("%.6f"):format(m.B[2])))",
         "1.000000", &bj_options},
        {"pem", pem,
         R"(pem(d, { na =, nb =, nc =, nd =, nf =, nk = 1, ic =, start = }) or pem(d, n4sid(d, …) [, { iterations =
            100 }]) -> idmodel)",
         R"(Prediction-error estimate of A(q) y(t) = B(q)/F(q) u(t) + C(q)/D(q) e(t) with any orders. Of a
            state-space model: all its entries, for several outputs together, missing samples of y bridged by
            a Kalman filter.)",
         R"(
            d = iddata{ y = {0, 1, .6, -.7, 1.5, 1.9}, u = {1, 0, -1, 2, 1, 0} }
            print(("%.6f"):format(pem(d, { na = 1, nb = 1, ic = "drop" }).theta[1])))",
         "-0.603163", &pem_options},
        {"idmodel:__tostring", model_text, "print(mod)",
         "The polynomials, the difference equation, parameters ± standard deviation, criteria and fit.", "",
         ""},
    }};

}  // namespace pendula::lua
