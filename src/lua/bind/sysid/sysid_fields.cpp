// Fields of estimated models, and state-space models by subspaces. Reads arguments, calls src/sysid.
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"
#include "sysid/fit/subspace.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;
using sysid::IdModel;
using sysid::PolyModel;
using sysid::StateSpaceModel;

namespace {

/// The covariance of the entries of a state-space model whose prediction errors were minimised; null
/// for other models.
const Mat* refined_covariance(Call& call) {
  const IdModel& m = idmodel_of(call);
  return m.state_space && m.state_space->covariance.size() > 0 ? &m.state_space->covariance : nullptr;
}

/// Rejects dependent inputs: undetermined entries have no deviation.
void require_independent_inputs(const IdModel& m) {
  if (m.state_space && !m.state_space->free_inputs.empty())
    throw Error(text("the inputs depend on each other, so that the entries of B have no covariance: ",
                     m.state_space->free_inputs[0], "; leave an input out: d:select{ u = … }"));
}

void require_parameters(Call& call, const char* what) {
  if (idmodel_of(call).state_space)
    throw Error(text("a state-space model has no ", what,
                     ": its entries depend on the coordinates of the state; see mod.A, "
                     "mod.B, mod.C, mod.D, mod.K and mod:tf(); pem(d, mod) gives a model with one"));
}

const StateSpaceModel& state_space(Call& call, const char* field) {
  const IdModel& m = idmodel_of(call);
  if (!m.state_space)
    throw Error(text(field, " belongs to state-space models (n4sid); this one is ", m.outputs[0].kind));
  return *m.state_space;
}

/// Pushes one value per output: the value itself for a single output, else a list.
template <class Push>
int each_output(Call& call, const Push& push) {
  const IdModel& m = idmodel_of(call);
  if (m.outputs.size() == 1) return push(m.outputs[0]);
  lua_createtable(call.L, static_cast<int>(m.outputs.size()), 0);
  lua_Integer i = 0;
  for (const PolyModel& row : m.outputs) {
    push(row);
    lua_rawseti(call.L, -2, ++i);
  }
  return 1;
}

int push_polynomials(lua_State* L, const std::vector<Vec>& list) {
  if (list.size() == 1) return push_row(L, list[0]);
  lua_createtable(L, static_cast<int>(list.size()), 0);
  lua_Integer i = 0;
  for (const Vec& v : list) {
    push_row(L, v);
    lua_rawseti(L, -2, ++i);
  }
  return 1;
}

int theta(Call& call) {
  if (refined_covariance(call)) return push_matrix(call.L, Mat(sysid::all_parameters(idmodel_of(call))));
  require_parameters(call, "theta");
  return each_output(call, [&](const PolyModel& m) { return push_matrix(call.L, Mat(m.theta)); });
}
int std_(Call& call) {
  require_independent_inputs(idmodel_of(call));
  if (const Mat* cov = refined_covariance(call))
    return push_matrix(call.L, Mat(cov->diagonal().cwiseMax(0.0).cwiseSqrt()));
  require_parameters(call, "std");
  for (const PolyModel& m : idmodel_of(call).outputs)
    if (m.std.size() == 0)
      throw Error(
          "this estimate has no standard deviation: it lies in a corner of the "
          "feasible set and converges like 1/N");
  return each_output(call, [&](const PolyModel& m) { return push_matrix(call.L, Mat(m.std)); });
}
int cov(Call& call) {
  require_independent_inputs(idmodel_of(call));
  if (const Mat* covariance = refined_covariance(call)) return push_matrix(call.L, *covariance);
  require_parameters(call, "cov");
  for (const PolyModel& m : idmodel_of(call).outputs)
    if (m.covariance.size() == 0)
      throw Error("this estimate has no covariance: it lies in a corner of the feasible set");
  return each_output(call, [&](const PolyModel& m) { return push_matrix(call.L, m.covariance); });
}
int correlation(Call& call) {
  require_parameters(call, "correlation");
  return each_output(call, [&](const PolyModel& m) {
    Mat c = m.covariance;
    const Vec s = c.diagonal().cwiseSqrt();
    for (Index i = 0; i < c.rows(); ++i)
      for (Index j = 0; j < c.cols(); ++j) c(i, j) = s[i] * s[j] > 0 ? c(i, j) / (s[i] * s[j]) : i == j;
    return push_matrix(call.L, c);
  });
}
int A(Call& call) {
  if (idmodel_of(call).state_space) return push_matrix(call.L, idmodel_of(call).state_space->A);
  return each_output(call, [&](const PolyModel& m) { return push_row(call.L, m.p.A); });
}
int B(Call& call) {
  if (idmodel_of(call).state_space) return push_matrix(call.L, idmodel_of(call).state_space->B);
  return each_output(call, [&](const PolyModel& m) { return push_polynomials(call.L, m.p.B); });
}
int C(Call& call) {
  if (idmodel_of(call).state_space) return push_matrix(call.L, idmodel_of(call).state_space->C);
  return each_output(call, [&](const PolyModel& m) { return push_row(call.L, m.p.C); });
}
int D(Call& call) {
  if (idmodel_of(call).state_space) return push_matrix(call.L, idmodel_of(call).state_space->D);
  return each_output(call, [&](const PolyModel& m) { return push_row(call.L, m.p.D); });
}
int F(Call& call) {
  require_parameters(call, "F");
  return each_output(call, [&](const PolyModel& m) { return push_polynomials(call.L, m.p.F); });
}
int noise(Call& call) { return call.push(idmodel_of(call).outputs[0].noise); }
int log_likelihood(Call& call) { return call.push(idmodel_of(call).outputs[0].log_likelihood); }
int names(Call& call) {
  return each_output(call, [&](const PolyModel& m) { return push_words(call.L, m.names); });
}
template <double sysid::Criteria::*member>
int quality(Call& call) {
  return each_output(call, [&](const PolyModel& m) { return call.push(m.quality.*member); });
}
int rows(Call& call) {
  return each_output(call, [&](const PolyModel& m) { return call.push(static_cast<long>(m.quality.rows)); });
}
int rank(Call& call) {
  return each_output(
      call, [&](const PolyModel& m) { return call.push(static_cast<long>(m.identifiability.rank)); });
}
int exact(Call& call) {
  return each_output(call, [&](const PolyModel& m) { return call.push(m.exact); });
}
int unidentifiable(Call& call) {
  return each_output(call,
                     [&](const PolyModel& m) { return push_words(call.L, m.identifiability.directions); });
}
int advice(Call& call) {
  return each_output(call, [&](const PolyModel& m) { return push_words(call.L, m.identifiability.advice); });
}
int kind(Call& call) { return call.push(idmodel_of(call).outputs[0].kind); }
int Ts(Call& call) { return call.push(idmodel_of(call).outputs[0].Ts); }

int K(Call& call) { return push_matrix(call.L, state_space(call, "K").K); }
int singular_values(Call& call) {
  return push_matrix(call.L, Mat(state_space(call, "singular_values").singular_values));
}
int innovations(Call& call) {
  const IdModel& m = idmodel_of(call);
  if (m.state_space) return push_matrix(call.L, m.state_space->innovations);
  Mat v = Mat::Zero(static_cast<Index>(m.outputs.size()), static_cast<Index>(m.outputs.size()));
  for (Index i = 0; i < v.rows(); ++i) v(i, i) = m.outputs[i].quality.sigma2;
  return m.outputs.size() == 1 ? call.push(v(0, 0)) : push_matrix(call.L, v);
}
int x0(Call& call) {
  const StateSpaceModel& s = state_space(call, "x0");
  Mat all(s.order(), static_cast<Index>(s.x0.size()));
  for (std::size_t k = 0; k < s.x0.size(); ++k) all.col(static_cast<Index>(k)) = s.x0[k];
  return push_matrix(call.L, all);
}

int push_integers(lua_State* L, const std::vector<int>& v) {
  if (v.size() == 1) {
    lua_pushinteger(L, v[0]);
    return 1;
  }
  lua_createtable(L, static_cast<int>(v.size()), 0);
  for (std::size_t i = 0; i < v.size(); ++i) {
    lua_pushinteger(L, v[i]);
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  return 1;
}

/// { na =, nb =, nk = … } as arguments of the estimator; { order = } for a state-space model.
int orders(Call& call) {
  const IdModel& m = idmodel_of(call);
  lua_State* L = call.L;
  if (m.state_space) {
    lua_createtable(L, 0, 1);
    lua_pushinteger(L, m.state_space->order());
    lua_setfield(L, -2, "order");
    return 1;
  }
  return each_output(call, [&](const PolyModel& row) {
    const sysid::Orders& o = row.orders;
    lua_createtable(L, 0, 6);
    const auto whole = [&](const char* key, int value) {
      if (value == 0) return;
      lua_pushinteger(L, value);
      lua_setfield(L, -2, key);
    };
    whole("na", o.na);
    whole("nc", o.nc);
    whole("nd", o.nd);
    if (o.nb.empty()) return 1;
    push_integers(L, o.nb);
    lua_setfield(L, -2, "nb");
    push_integers(L, o.nk);
    lua_setfield(L, -2, "nk");
    for (const int f : o.nf)
      if (f > 0) {
        push_integers(L, o.nf);
        lua_setfield(L, -2, "nf");
        break;
      }
    return 1;
  });
}

int samples(Call& call) { return call.push(static_cast<long>(idmodel_of(call).outputs[0].samples)); }
int simulation_percent(Call& call) {
  return each_output(call, [&](const PolyModel& m) { return call.push(m.simulation.percent); });
}
int y_names(Call& call) {
  std::vector<std::string> out;
  for (const PolyModel& m : idmodel_of(call).outputs) out.push_back(m.y_name);
  return push_words(call.L, out);
}
int u_names(Call& call) {
  std::vector<std::string> out = idmodel_of(call).outputs[0].u_names;
  out.resize(static_cast<std::size_t>(idmodel_of(call).inputs));
  return push_words(call.L, out);
}

// ── subspaces ──

void read_order(Call& call, const Options& o, sysid::SubspaceOptions& s) {
  const std::vector<int> v = to_whole_numbers(call.L, o.push("order"), "order");
  lua_settop(call.L, call.count());
  if (v.size() > 2)
    throw Error(text("order: expected a number or a range {from, to}, got ", v.size(), " numbers"));
  if (v.size() == 2) {
    s.least = v[0];
    s.most = v[1];
  } else if ((s.order = v[0]) < 1) {
    throw Error(text("order must be at least 1, got ", v[0]));
  }
}

int n4sid(Call& call) {
  const IdData& d = call.object<IdData>(1, "data");
  sysid::SubspaceOptions s;
  if (call.has(2) && !lua_istable(call.L, 2)) {
    const long n = call.integer(2, "order");
    if (n < 1 || n > 100) throw Error(text("order must lie between 1 and 100, got ", n));
    s.order = static_cast<int>(n);
  }
  const bool table = call.has(2) && lua_istable(call.L, 2);
  const Options o = call.options(table ? 2 : 3);
  if (o.has("order")) read_order(call, o, s);
  s.weighting = o.string("weight", s.weighting);
  for (char& c : s.weighting) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  if (s.weighting != "CVA" && s.weighting != "MOESP" && s.weighting != "N4SID")
    throw Error(text("unknown weight '", s.weighting, "'.",
                     did_you_mean(s.weighting, {"CVA", "MOESP", "N4SID"}), " (CVA, MOESP, N4SID)"));
  const long horizon = o.integer("horizon", 0);
  if (o.has("horizon") && (horizon < 2 || horizon > 1000))
    throw Error(text("horizon must lie between 2 and 1000 block rows, got ", horizon));
  s.horizon = static_cast<int>(horizon);
  s.feedthrough = o.boolean("D", false);
  s.noise = o.boolean("K", true);
  return call.push(std::make_shared<const IdModel>(sysid::subspace(d, s)));
}

const OptionTable n4sid_options = {
    {"order", "integer or range", "", "states, or { least, most } to choose from"},
    {"weight", "string", "\"CVA\"", "weighting of the projection", "CVA|MOESP|N4SID"},
    {"horizon", "integer", "", "block rows of past and future"},
    {"D", "boolean", "false", "estimate a direct term"},
    {"K", "boolean", "true", "false: an output-error model"},
};

}  // namespace

extern const Module idmodel_fields_module = {
    "identification",
    "",
    {
        {"n4sid", n4sid,
         R"(n4sid(d, order [, { weight =, … }]) or n4sid(d, { order =, weight = "CVA", horizon =, D = false, K =
            true }) -> idmodel)",
         R"(State-space model x(t+1) = A x + B u + K e, y = C x + D u + e by a subspace method: no search,
            no starting values, any number of inputs and outputs. order: a number, or a range {1, 10} to
            choose from (also without it). weight: "CVA", "MOESP" or "N4SID"; horizon: block rows of past
            and future; D = true estimates a direct term; K = false is an output-error model. mod:ss()
            gives the linear system.)",
         R"(
            u, y = {}, {}
            for t = 1, 60 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-1] or 0) end
            m = n4sid(iddata{ y = y, u = u }, 1)
            print(("%.6f %.6f"):format(m.A[1], m.C[1]*m.B[1])))",
         "0.500000 1.000000", &n4sid_options},
        {"idmodel#K", K, "mod.K -> matrix", "State space: the gain of the noise, that of the Kalman filter.",
         R"(
             u, y = {}, {}
             for i = 1, 60 do u[i] = (-1)^(i*i//3); y[i] = 0.5*(y[i-1] or 0) + (u[i-1] or 0) end
             n4sid(iddata{ y = y, u = u }, 1).K.rows)",
         "1"},
        {"idmodel#x0", x0, "mod.x0 -> column",
         "State space: the estimated state at the first sample, a column per experiment.", R"(
             u, y = {}, {}
             for i = 1, 60 do u[i] = (-1)^(i*i//3); y[i] = 0.5*(y[i-1] or 0) + (u[i-1] or 0) end
             #n4sid(iddata{ y = y, u = u }, 1).x0)",
         "1"},
        {"idmodel#singular_values", singular_values, "mod.singular_values -> column",
         "State space: by which the order is judged.", R"(
             u, y = {}, {}
             for i = 1, 60 do u[i] = (-1)^(i*i//3); y[i] = 0.5*(y[i-1] or 0) + (u[i-1] or 0) end
             m = n4sid(iddata{ y = y, u = u }, 1)
             m.singular_values[1] > 1e3*m.singular_values[2])",
         "true"},
        {"idmodel#noise_variance", innovations, "mod.noise_variance -> number or matrix",
         "Variance of e(t), of several outputs their covariance.", "", ""},
        {"idmodel#orders", orders, "mod.orders -> { na =, nb =, … }",
         "The orders, as the estimator takes them.", "", ""},
        {"idmodel#samples", samples, "mod.samples -> integer", "Samples of the estimation data.", "", ""},
        {"idmodel#simulation_fit", simulation_percent, "mod.simulation_fit -> number",
         "Simulation fit on the estimation data in %; -inf where it diverges.", "", ""},
        {"idmodel#y_names", y_names, "mod.y_names -> list", "The names of the outputs.", "", ""},
        {"idmodel#u_names", u_names, "mod.u_names -> list", "The names of the inputs.", "", ""},
        {"idmodel#theta", theta, "mod.theta -> column",
         "The estimated parameters, in the order of mod.names.", "", ""},
        {"idmodel#std", std_, "mod.std -> column",
         "Their standard deviations; inf where a parameter is not identifiable.", "", ""},
        {"idmodel#cov", cov, "mod.cov -> matrix", "Their covariance, σ̂²(ΦᵀΦ)⁻¹ for linear least squares.", "",
         ""},
        {"idmodel#correlation", correlation, "mod.correlation -> matrix", "Their correlation.", "", ""},
        {"idmodel#covariance", cov, "mod.covariance -> matrix", "The same as mod.cov.", "", ""},
        {"idmodel#names", names, "mod.names -> list", "The names of the parameters: a1, a2, b1 and so on.",
         "", ""},
        {"idmodel#A", A, "mod.A -> row", "A(q) = 1 + a1 q⁻¹ + … + a_na q^(-na); state space: the matrix.", "",
         ""},
        {"idmodel#B", B, "mod.B -> row", "B(q), leading zeros for the delay; several inputs: a list.", "",
         ""},
        {"idmodel#C", C, "mod.C -> row", "C(q) = 1 + c1 q⁻¹ + … + c_nc q^(-nc).", "", ""},
        {"idmodel#D", D, "mod.D -> row", "D(q) = 1 + d1 q⁻¹ + … + d_nd q^(-nd).", "", ""},
        {"idmodel#F", F, "mod.F -> row", "F(q) = 1 + f1 q⁻¹ + …; several inputs: a list.", "", ""},
        {"idmodel#loss", quality<&sysid::Criteria::loss>, "mod.loss -> number", "V = SSE/rows.", "", ""},
        {"idmodel#mse", quality<&sysid::Criteria::loss>, "mod.mse -> number",
         "The same as mod.loss: the mean square of the one-step errors.", "", ""},
        {"idmodel#sse", quality<&sysid::Criteria::sse>, "mod.sse -> number",
         "Sum of squared one-step errors.", "", ""},
        {"idmodel#sigma2", quality<&sysid::Criteria::sigma2>, "mod.sigma2 -> number",
         "Noise variance SSE/(rows - d).", "", ""},
        {"idmodel#fpe", quality<&sysid::Criteria::fpe>, "mod.fpe -> number",
         "Final prediction error V (1 + d/N)/(1 - d/N).", "", ""},
        {"idmodel#aic", quality<&sysid::Criteria::aic>, "mod.aic -> number",
         "Akaike's criterion N ln V + 2d.", "", ""},
        {"idmodel#bic", quality<&sysid::Criteria::bic>, "mod.bic -> number",
         "Bayesian criterion N ln V + d ln N.", "", ""},
        {"idmodel#fit_percent", quality<&sysid::Criteria::fit>, "mod.fit_percent -> number",
         "One-step fit on the estimation data in %.", "", ""},
        {"idmodel#rows", rows, "mod.rows -> integer", "Rows of the regression that were used.", "", ""},
        {"idmodel#rank", rank, "mod.rank -> integer", "Rank of the regressor.", "", ""},
        {"idmodel#exact", exact, "mod.exact -> boolean", "The data are reproduced to rounding.", "", ""},
        {"idmodel#unidentifiable", unidentifiable, "mod.unidentifiable -> list",
         "The combinations of parameters that the data leave free, in words; empty if there are none.", "",
         ""},
        {"idmodel#advice", advice, "mod.advice -> list", "Why they are free, and the remedy.", "", ""},
        {"idmodel#noise", noise, "mod.noise -> string", "Maximum likelihood: the density in words.", "", ""},
        {"idmodel#log_likelihood", log_likelihood, "mod.log_likelihood -> number",
         "Maximum likelihood: ln L at θ.", "", ""},
        {"idmodel#kind", kind, "mod.kind -> string", "ARX, FIR, ARMAX, OE, BJ, polynomial or state space.",
         "", ""},
        {"idmodel#Ts", Ts, "mod.Ts -> number", "The sampling time.", "", ""},
    }};

}  // namespace pendula::lua
