// Least squares of arbitrary functions, refinement of state-space models, forecasts. Reads
// arguments, calls src/sysid.
#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"
#include "sysid/fit/bounded_search.hpp"
#include "sysid/fit/continuous.hpp"
#include "sysid/model/kalman_errors.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;
using sysid::IdModel;

/// A minimum found by nlsq, with the covariance of its parameters.
struct FunctionFit {
  sysid::BoundedMinimum minimum;
  sysid::SearchCovariance estimate;
};
template <>
struct TypeName<FunctionFit> {
  static constexpr const char* value = "nlsq_result";
};

namespace {

Vec numbers_option(Call& call, const Options& o, const char* key) {
  if (!o.has(key)) return {};
  const Vec v = to_numeric_matrix(call.L, o.push(key), key).reshaped();
  lua_settop(call.L, call.count());
  return v;
}

/// r(θ) as a column.
sysid::Residuals residuals_of(lua_State* L, int index) {
  return [L, index](const Vec& theta) {
    lua_pushvalue(L, index);
    push_matrix(L, Mat(theta));
    protected_call(L, 1, 1);
    const Vec r = to_data(L, lua_gettop(L), "the residuals").reshaped();
    lua_pop(L, 1);
    return r;
  };
}

int nlsq(Call& call) {
  call.function(1, "r");
  const Vec start = to_numeric_matrix(call.L, 2, "start").reshaped();
  const Options o = call.options(3);
  sysid::Bounds bounds{numbers_option(call, o, "lower"), numbers_option(call, o, "upper")};
  const double infinity = std::numeric_limits<double>::infinity();
  if (bounds.lower.size() == 0 && bounds.upper.size() > 0)
    bounds.lower = Vec::Constant(start.size(), -infinity);
  if (bounds.upper.size() == 0 && bounds.lower.size() > 0)
    bounds.upper = Vec::Constant(start.size(), infinity);
  const Vec scale = numbers_option(call, o, "scale");
  const auto iterations = static_cast<int>(o.integer("iterations", 100));
  const sysid::BoundedMinimum m =
      sysid::least_squares_within(residuals_of(call.L, 1), start, bounds, scale, iterations);
  return call.push(std::make_shared<const FunctionFit>(FunctionFit{m, sysid::covariance_of(m)}));
}

const FunctionFit& function_fit(Call& call) { return call.object<FunctionFit>(1, "nlsq_result"); }
Vec deviations_of(const FunctionFit& f) { return f.estimate.covariance.diagonal().cwiseMax(0.0).cwiseSqrt(); }
std::string verdict_of(const FunctionFit& f) {
  return f.minimum.search.converged() ? "a minimum" : ending_text(f.minimum.search);
}
int minimum_theta(Call& call) { return push_matrix(call.L, Mat(function_fit(call).minimum.search.theta)); }
int minimum_std(Call& call) { return push_matrix(call.L, Mat(deviations_of(function_fit(call)))); }
int minimum_cov(Call& call) { return push_matrix(call.L, function_fit(call).estimate.covariance); }
int minimum_residuals(Call& call) { return push_matrix(call.L, Mat(function_fit(call).minimum.residuals)); }
int minimum_jacobian(Call& call) { return push_matrix(call.L, function_fit(call).minimum.J); }
int minimum_sse(Call& call) { return call.push(function_fit(call).minimum.residuals.squaredNorm()); }
int minimum_sigma2(Call& call) { return call.push(function_fit(call).estimate.sigma2); }
int minimum_slope(Call& call) { return call.push(function_fit(call).minimum.search.angle); }
int minimum_iterations(Call& call) { return call.push(function_fit(call).minimum.search.iterations); }
int minimum_rank(Call& call) { return call.push(static_cast<long>(function_fit(call).estimate.rank)); }
int minimum_converged(Call& call) { return call.push(function_fit(call).minimum.search.converged()); }
int minimum_verdict(Call& call) { return call.push(verdict_of(function_fit(call))); }
int minimum_active(Call& call) {
  const auto& active = function_fit(call).minimum.active;
  lua_createtable(call.L, static_cast<int>(active.size()), 0);
  lua_Integer k = 0;
  for (const Index i : active) {
    lua_pushinteger(call.L, i + 1);
    lua_rawseti(call.L, -2, ++k);
  }
  return 1;
}

int minimum_text(Call& call) {
  const FunctionFit& f = function_fit(call);
  const Vec &theta = f.minimum.search.theta, std = deviations_of(f);
  const Index rows = f.minimum.residuals.size();
  std::string out = text("least squares of ", theta.size(), theta.size() == 1 ? " parameter" : " parameters",
                         ", ", rows, rows == 1 ? " residual" : " residuals",
                         ": SSE = ", rounded(f.minimum.residuals.squaredNorm(), 6), "\n");
  constexpr Index most = 30;
  for (Index i = 0; i < std::min(theta.size(), most); ++i) {
    const auto& active = f.minimum.active;
    const bool held = std::find(active.begin(), active.end(), i) != active.end();
    out += text("  θ[", i + 1, "] = ", rounded(theta[i], 6),
                held ? "  (on a bound)" : text(" ± ", rounded(std[i], 4)), "\n");
  }
  if (theta.size() > most) out += text("  … ", theta.size() - most, " more in .theta\n");
  if (f.estimate.rank + static_cast<Index>(f.minimum.active.size()) < theta.size())
    out += text("  warning: the residuals determine only ", f.estimate.rank, " of ", theta.size(),
                " parameters\n");
  return call.push(out + "  search: " + verdict_of(f));
}

int with_theta(Call& call) {
  const Vec theta = to_numeric_matrix(call.L, 2, "theta").reshaped();
  return call.push(std::make_shared<const IdModel>(sysid::with_parameters(idmodel_of(call), theta)));
}

const OptionTable forecast_options = {
    {"u", "list or matrix", "", "future inputs, one row per step"},
};

int forecast(Call& call) {
  const IdData& d = call.object<IdData>(2, "data");
  const long steps = call.integer(3, "steps");
  if (steps < 1) throw Error(text("steps must be at least 1, got ", steps));
  const Options o = call.options(4);
  Mat u(steps > 0 ? steps : 0, d.inputs());
  if (o.has("u"))
    u = to_data(call.L, o.push("u"), "u");
  else if (d.inputs() > 0)
    throw Error(text("the model has inputs: give those of the future, mod:forecast(d, ", steps,
                     ", { u = … }), one row per step"));
  if (u.rows() != steps && u.cols() == steps) u.transposeInPlace();  // a list of signals
  lua_settop(call.L, call.count());
  const sysid::Forecast f = sysid::forecast(idmodel_of(call), d, u, steps);
  push_matrix(call.L, f.y);
  push_matrix(call.L, f.std);
  return 2;
}

sysid::ContinuousModel continuous_model(Call& call, int i) {
  const double delay = call.number(i + 2, "delay");
  if (!(delay >= 0)) throw Error("the delay must not be negative");
  return {to_numeric_matrix(call.L, i, "num").reshaped(), to_numeric_matrix(call.L, i + 1, "den").reshaped(),
          delay};
}

int held_response(Call& call) {
  const Vec u = to_data(call.L, 4, "u").reshaped();
  const double Ts = call.number(5, "Ts");
  if (!(Ts > 0)) throw Error("Ts must be positive");
  return push_matrix(call.L, Mat(sysid::simulate_held(continuous_model(call, 1), u, Ts)));
}

int continuous_errors(Call& call) {
  const IdData& d = call.object<IdData>(4, "data");
  if (d.inputs() != 1 || d.outputs() != 1)
    throw Error("one input and one output; choose: d:select{ y = 1, u = 1 }");
  const bool free = call.string(5, "ic", "zero") == "estimate";
  return push_matrix(call.L, Mat(sysid::continuous_errors(continuous_model(call, 1), d, free)));
}

const OptionTable nlsq_options = {
    {"lower", "column", "", "least values of the parameters (-math.huge: none)"},
    {"upper", "column", "", "largest values of the parameters (math.huge: none)"},
    {"scale", "column", "1", "sizes that matter, for the steps of the difference quotients"},
    {"iterations", "integer", "100", "most steps of Gauss-Newton"},
};

}  // namespace

extern const Module search_module = {
    "identification",
    "",
    {
        {"nlsq", nlsq, "nlsq(r, start [, { lower =, upper =, scale =, iterations = 100 }]) -> nlsq_result",
         R"(Minimises Σ rᵢ(θ)² for a function r that gives a column of residuals, by Gauss–Newton steps in a trust
            region with difference quotients, within bounds if they are given.)",
         R"(
            r = nlsq(function(p) return { p[1] - 1, p[1]*p[2] - 6, p[2] - 5.9 } end, { 1, 1 }, { upper = { 9, 5 } })
            print(r.active[1], r.theta[2]))",
         "2 5.0", &nlsq_options},
        {"nlsq_result#theta", minimum_theta, "r.theta -> column", "The parameters.", "", ""},
        {"nlsq_result#std", minimum_std, "r.std -> column",
         "Their standard deviations; 0 where a parameter lies on a bound.", "", ""},
        {"nlsq_result#cov", minimum_cov, "r.cov -> matrix", "Their covariance, σ² (JᵀJ)⁻¹.", "", ""},
        {"nlsq_result#residuals", minimum_residuals, "r.residuals -> column", "The residuals at the minimum.",
         "", ""},
        {"nlsq_result#J", minimum_jacobian, "r.J -> matrix", "Their derivatives by the parameters.", "", ""},
        {"nlsq_result#sse", minimum_sse, "r.sse -> number", "Their sum of squares.", "", ""},
        {"nlsq_result#sigma2", minimum_sigma2, "r.sigma2 -> number", "SSE/(residuals - rank).", "", ""},
        {"nlsq_result#rank", minimum_rank, "r.rank -> integer",
         "The parameters that the residuals determine.", "", ""},
        {"nlsq_result#active", minimum_active, "r.active -> list",
         "The parameters that lie on a bound, by number.", "", ""},
        {"nlsq_result#slope", minimum_slope, "r.slope -> number",
         "The slope at the end, relative: 0 at a minimum.", "", ""},
        {"nlsq_result#iterations", minimum_iterations, "r.iterations -> integer", "Steps that were taken.",
         "", ""},
        {"nlsq_result#converged", minimum_converged, "r.converged -> boolean",
         "The search ended in a minimum.", "", ""},
        {"nlsq_result#verdict", minimum_verdict, "r.verdict -> string", "How it ended, in words.", "", ""},
        {"nlsq_result:__tostring", minimum_text, "print(r)",
         "The parameters with their deviations and the verdict.", "", ""},
        {"held_response", held_response, "held_response(num, den, delay, u, Ts) -> column",
         R"(The output of num(s)/den(s) e^{-delay s} from rest at samples Ts apart, exact for an input that is constant
            between them; the delay may be any fraction of Ts.)",
         "return math.abs(held_response({1}, {1, 1}, 0.5, {1, 1, 1}, 1)[3] - (1 - math.exp(-1.5))) < 1e-14",
         "true"},
        {"continuous_errors", continuous_errors,
         R"(continuous_errors(num, den, delay, d [, ic = "zero"]) -> column)",
         R"(y - G u of data with one input and output for a transfer function in continuous time, at the samples that
            are there; ic = "estimate" fits the initial state.)",
         "d = iddata{ y = {0, 0.5, 1}, u = {1, 1, 1} }\nreturn continuous_errors({1}, {1, 0}, 0, d)[2]",
         "-0.5"},
        {"idmodel:with_theta", with_theta, "mod:with_theta(theta) -> idmodel",
         R"(The model with other parameters, in the order of mod.theta (of a state-space model the entries of A, B,
            C, D where it has one, and K, column by column).)",
         R"(
            d = iddata{ y = {0, 2, 1, 4}, u = {1, 0.5, 2, 1} }
            print(fir(d, { nb = 1 }):with_theta{ 3 }.B))",
         "0  3"},
        {"idmodel:forecasts", forecast, "mod:forecasts(d, steps [, { u = }]) -> y, std",
         R"(The forecast ŷ(N + k | N) after the data with its standard deviation, one row per step: mod:forecast(d,
            steps) with a picture.)",
         R"(
            d = iddata{ y = {8, 4, 2, 1} }
            y, s = arx(d, { na = 1 }):forecasts(d, 2)
            print(y.T))",
         "0.5  0.25", &forecast_options},
    }};

}  // namespace pendula::lua
