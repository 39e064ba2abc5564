// Estimated models applied to data: predictions, simulations, residuals, fits.
#include <cmath>
#include <limits>

#include "base/counted.hpp"
#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;

sysid::Seed read_seed(const Options& options, sysid::Seed fallback) {
  if (options.has("ic") && options.has("init")) throw Error("ic and init mean the same; give ic alone");
  if (options.has("init")) return sysid::seed_named(options.string("init"));
  return options.has("ic") ? sysid::seed_named(options.string("ic")) : fallback;
}

namespace {

struct Mode {
  Index horizon = 1;
  sysid::Seed seed = sysid::Seed::data;
};

const OptionTable mode_options = {
    {"3", "integer or string", "1", "the horizon, or the kind of response", "prediction|simulation"},
    {"horizon", "integer or string", "1", "steps ahead, or \"simulation\"", "prediction|simulation"},
    {"ic", "string", "", "the state before the first sample", "data|zero|estimate"},
    {"init", "string", "", "the name of ic in earlier versions", "data|zero|estimate"},
};

/// Argument 3: nothing, a horizon, "simulation", or { horizon =, ic = }.
Mode read_mode(Call& call, Index horizon) {
  Mode mode;
  mode.horizon = horizon;
  if (!idmodel_of(call).outputs[0].p.equation_error()) mode.seed = sysid::Seed::estimate;
  const auto positive = [](long h) {
    if (h < 1) throw Error(text("horizon must be at least 1, got ", h));
    return static_cast<Index>(h);
  };
  const auto word = [&](const std::string& w) -> Index {
    if (w == "simulation") return 0;
    if (w == "prediction" || w == "1-step") return 1;
    throw Error(text("unknown mode '", w, "'.", did_you_mean(w, {"simulation", "prediction"}),
                     " (\"prediction\", \"simulation\", or a horizon)"));
  };
  if (!call.has(3)) return mode;
  if (lua_type(call.L, 3) == LUA_TSTRING) {
    mode.horizon = word(call.string(3, "mode"));
  } else if (!lua_istable(call.L, 3)) {
    if (lua_type(call.L, 3) == LUA_TNUMBER && std::isinf(lua_tonumber(call.L, 3)))
      mode.horizon = 0;
    else
      mode.horizon = positive(call.integer(3, "horizon"));
  } else {
    const Options o = call.options(3);
    if (o.has("horizon")) {
      const int at = o.push("horizon");
      if (lua_type(call.L, at) == LUA_TSTRING)
        mode.horizon = word(lua_tostring(call.L, at));
      else if (lua_type(call.L, at) == LUA_TNUMBER && std::isinf(lua_tonumber(call.L, at)))
        mode.horizon = 0;
      else
        mode.horizon = positive(o.integer("horizon", 1));
      lua_settop(call.L, call.count());
    }
    mode.seed = read_seed(o, mode.seed);
  }
  return mode;
}

std::vector<sysid::Response> respond(Call& call, Index horizon) {
  const Mode mode = read_mode(call, horizon);
  return sysid::predict(idmodel_of(call), call.object<IdData>(2, "data"), mode.horizon, mode.seed);
}

int push_columns(Call& call, const std::vector<sysid::Response>& r, Vec sysid::Response::*member) {
  Index rows = std::numeric_limits<Index>::max();
  for (const auto& each : r) rows = std::min(rows, (each.*member).size());
  Mat m(rows, static_cast<Index>(r.size()));
  for (std::size_t i = 0; i < r.size(); ++i) m.col(static_cast<Index>(i)) = (r[i].*member).tail(rows);
  return push_matrix(call.L, m);
}

int predict(Call& call) { return push_columns(call, respond(call, 1), &sysid::Response::values); }

int simulate(Call& call) {
  const sysid::IdModel& m = idmodel_of(call);
  const SimulationData of =
      simulation_data(call, m.inputs, static_cast<Index>(m.outputs.size()), m.outputs[0].Ts);
  Mode mode = read_mode(call, 0);
  if (of.inputs_alone && !call.has(3)) mode.seed = sysid::Seed::zero;
  if (of.inputs_alone && (mode.seed != sysid::Seed::zero || mode.horizon != 0))
    throw Error(
        "inputs alone have no measured outputs: write mod:simulate(u), which starts from rest, or give "
        "iddata{ y = …, u = …, Ts = 1 }");
  return push_columns(call, sysid::predict(m, of.data, mode.horizon, mode.seed), &sysid::Response::values);
}
int model_residuals(Call& call) { return push_columns(call, respond(call, 1), &sysid::Response::errors); }

int model_fit(Call& call) {
  const Mode mode = read_mode(call, 1);
  const auto r = respond(call, 1);
  if (r.size() == 1) {
    call.push(r[0].fit);
  } else {
    Vec all(static_cast<Index>(r.size()));
    for (std::size_t i = 0; i < r.size(); ++i) all[i] = r[i].fit;
    push_matrix(call.L, Mat(all));
  }
  const std::string what = mode.horizon == 0 ? "simulation" : text(mode.horizon, "-step prediction");
  call.push(text("% fit, ", what, ", ", counted(r[0].rows.size(), "sample")));
  return 2;
}

int rmse(Call& call) {
  const auto r = respond(call, 1);
  Vec all(static_cast<Index>(r.size()));
  for (Index i = 0; i < all.size(); ++i)
    all[i] =
        std::sqrt(r[i].errors.squaredNorm() / static_cast<double>(std::max<Index>(1, r[i].errors.size())));
  return push_value(call.L, Mat(all));
}

}  // namespace

extern const Module idmodel_predict_module = {
    "identification",
    "",
    {
        {"idmodel:predict", predict, "mod:predict(d [, horizon | { horizon = 1, ic = }]) -> column",
         R"(ŷ(t|t-horizon) at every sample. ic is the state before the first sample: "data" takes the
            first measured outputs as they are, "zero" starts from rest (zero initial conditions), "estimate"
            fits the initial state.)",
         R"(
            d = iddata{ y = {0, 2, 1, 4}, u = {1, 0.5, 2, 1} }
            print(fir(d, { nb = 1 }):predict(d).T))",
         "0  2  1  4", &mode_options},
        {"idmodel:simulate", simulate, "mod:simulate(d | u [, { ic = }]) -> column",
         "The output computed from the input alone; ic as in predict. A list or matrix u of inputs: from rest.",
         R"(
            d = iddata{ y = {1, .5, .25, .125}, u = {0, 0, 0, 0} }
            print(arx(d, { na = 1 }):simulate(d).T))",
         "1  0.5  0.25  0.125", &mode_options},
        {"idmodel:residuals", model_residuals,
         "mod:residuals(d [, horizon | { horizon = 1, ic = }]) -> column",
         "y - ŷ at the samples that are compared: those after the first ones that seed the predictor.",
         R"(
            d = iddata{ y = {0, 2, 1, 4}, u = {1, 0.5, 2, 1} }
            #fir(d, { nb = 1 }):residuals(d))",
         "3", &mode_options},
        {"idmodel:fit", model_fit,
         R"(mod:fit(d [, horizon | "simulation" | { horizon =, ic = }]) -> percent, label)",
         "100 (1 - ‖y - ŷ‖/‖y - ȳ‖) on the compared samples, and a label that names the comparison.",
         R"(
            d = iddata{ y = {0, 2, 1, 4}, u = {1, 0.5, 2, 1} }
            print(fir(d, { nb = 1 }):fit(d)))",
         "100.0 % fit, 1-step prediction, 3 samples", &mode_options},
        {"idmodel:rmse", rmse, R"(mod:rmse(d [, horizon | "simulation" | { horizon =, ic = }]) -> number)",
         "√(mean (y - ŷ)²) on the compared samples, in the unit of y; a column for several outputs.",
         R"(
            d = iddata{ y = {0, 2, 1, 4}, u = {1, 0.5, 2, 1} }
            return fir(d, { nb = 1 }):rmse(d) < 1e-12)",
         "true", &mode_options},
    }};

}  // namespace pendula::lua
