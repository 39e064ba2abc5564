// The program of bench/dae.lua: pendula with words for its peers on the same model,
// model:ida{…}, :cvode{…}, :adams{…}, :erk{…}, and model:quad{…}, reference values.
#include <cstdio>
#include <memory>

#include "cvode.hpp"
#include "dae/model/first_order.hpp"
#include "expr/graph/derivative.hpp"
#include "ida.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/session/state.hpp"
#include "quad.hpp"
#include "shell/script.hpp"

namespace pendula::bench {
namespace {

using lua::Call;

integrate::Point point_of(const dae::FirstOrder& form, const dae::ConsistentState& start) {
  const auto value = [&](Expr leaf) {
    const auto known = start.values.find(leaf);
    return known == start.values.end() ? start(leaf) : known->second;
  };
  integrate::Point p;
  p.t = start.t;
  p.x.resize(static_cast<Eigen::Index>(form.x.size()));
  p.xdot.resize(p.x.size());
  p.z.resize(static_cast<Eigen::Index>(form.z.size()));
  for (std::size_t i = 0; i < form.x.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    p.x[k] = value(form.x[i]);
    p.xdot[k] = value(derivative_leaf(form.x[i]));
  }
  for (std::size_t i = 0; i < form.z.size(); ++i) p.z[static_cast<Eigen::Index>(i)] = value(form.z[i]);
  return p;
}

std::string name_of(Expr leaf) {
  const Symbol& s = symbol_of(leaf);
  return s.name + std::string(static_cast<std::size_t>(s.order), '\'');
}

const lua::OptionTable place_options = {
    {"start", "start or table", "", "where it begins", "@variables"},
    {"to", "number", "", "the end of the interval, in s"},
    {"from", "number", "0", "the time of the start, in s"},
    {"params", "table", "", "values of parameters", "@parameters"},
    {"inputs", "table", "", "functions of time", "@inputs"},
};
const lua::OptionTable tolerance_options = {
    {"rtol", "number", "1e-6", "relative tolerance"},
    {"atol", "number", "", "absolute tolerance; without it rtol"},
};
const lua::OptionTable peer_options = lua::joined(place_options, tolerance_options);
const lua::OptionTable ida_options = lua::joined(
    peer_options, {{"sparse", "boolean", "false", "KLU in place of dense matrices"},
                   {"suppress", "boolean", "true", "algebraic variables are left out of the error test"},
                   {"coefficient", "number", "", "of the test of convergence; without it IDA's own"},
                   {"flush", "boolean", "false", "denormal numbers are taken for 0"}});
const lua::OptionTable quad_options =
    lua::joined(place_options, {{"tolerance", "number", "", "of a step"},
                                {"size", "number", "", "below which unknowns are measured absolutely"},
                                {"stages", "integer", "7", "of the collocation method"},
                                {"gauss", "boolean", "false", "Gauss in place of Radau points"},
                                {"breaks", "list", "", "times at which derivatives jump"}});

/// What every peer is given: the model with numbers, at its start.
struct Given {
  Given(Call& call, const lua::Options& options) {
    const auto model = call.shared<dae::Model>(1, "model");
    const dae::ConsistentStatePtr start = lua::read_start(call.L, options, model);
    lua_settop(call.L, call.count());
    form = dae::first_order(*model);
    Vec parameters(static_cast<Eigen::Index>(form.p.size()));
    for (std::size_t i = 0; i < form.p.size(); ++i)
      parameters[static_cast<Eigen::Index>(i)] = (*start)(form.p[i]);
    from = point_of(form, *start);
    problem = std::make_unique<integrate::Problem>(form, parameters);
  }
  std::string name(std::size_t k) const {
    return name_of(k < form.x.size() ? form.x[k] : form.z[k - form.x.size()]);
  }
  dae::FirstOrder form;
  integrate::Point from;
  std::unique_ptr<integrate::Problem> problem;
};

int quad(Call& call) {
  const lua::Options options = call.options(2, quad_options);
  const Given given(call, options);
  QuadOptions o;
  o.to = options.number("to");
  o.tolerance = options.number("tolerance", o.tolerance);
  o.size = options.number("size", o.size);
  o.stages = static_cast<int>(options.number("stages", 7));
  o.gauss = options.boolean("gauss", false);
  if (options.has("breaks")) {
    const int list = options.push("breaks");
    for (lua_Integer k = 1; lua_rawgeti(call.L, list, k) == LUA_TNUMBER; ++k)
      o.breaks.push_back(lua_tonumber(call.L, -1));
  }
  const QuadResult result = run_quad(*given.problem, given.from, o);
  lua_State* L = call.L;
  lua_newtable(L);
  for (std::size_t k = 0; k < result.y.size(); ++k) {
    lua_pushstring(L, result.y[k].c_str());
    lua_setfield(L, -2, given.name(k).c_str());
  }
  lua_pushnumber(L, static_cast<double>(result.steps));
  lua_setfield(L, -2, "steps");
  return 1;
}

int push(Call& call, const Given& given, const IdaResult& result) {
  lua_State* L = call.L;
  lua_newtable(L);
  for (Eigen::Index i = 0; i < result.y.size(); ++i) {
    lua_pushnumber(L, result.y[i]);
    lua_setfield(L, -2, given.name(static_cast<std::size_t>(i)).c_str());
  }
  const auto set = [&](const char* key, double v) {
    lua_pushnumber(L, v);
    lua_setfield(L, -2, key);
  };
  set("seconds", result.seconds);
  set("steps", static_cast<double>(result.steps));
  set("residuals", static_cast<double>(result.residuals));
  set("jacobians", static_cast<double>(result.jacobians));
  if (!result.trouble.empty()) {
    lua_pushstring(L, result.trouble.c_str());
    lua_setfield(L, -2, "trouble");
  }
  return 1;
}

IdaOptions tolerances_of(const lua::Options& options) {
  IdaOptions o;
  o.to = options.number("to");
  o.rtol = options.number("rtol", 1e-6);
  o.atol = options.number("atol", o.rtol);
  return o;
}

int ida(Call& call) {
  const lua::Options options = call.options(2, ida_options);
  const Given given(call, options);
  IdaOptions o = tolerances_of(options);
  o.sparse = options.boolean("sparse", false);
  o.suppress_algebraic = options.boolean("suppress", true);
  o.newton_coefficient = options.number("coefficient", 0);
  o.flush_denormals = options.boolean("flush", false);
  return push(call, given, run_ida(*given.problem, given.from, o));
}

template <OdePeer peer>
int ode_peer(Call& call) {
  const lua::Options options = call.options(2, peer_options);
  const Given given(call, options);
  return push(call, given, run_ode_peer(*given.problem, given.from, peer, tolerances_of(options)));
}

const lua::Module module = {
    "ida",
    "The peer",
    {{"model:ida", ida, "sys:ida(options) -> table",
      "IDA of SUNDIALS on the same model: end values by name, seconds, steps, residuals, jacobians."},
     {"model:cvode", ode_peer<OdePeer::bdf>, "sys:cvode(options) -> table",
      "CVODE, BDF with dense matrices, on x′ = f(t, x): as sys:ida."},
     {"model:adams", ode_peer<OdePeer::adams>, "sys:adams(options) -> table", "CVODE, Adams: as sys:ida."},
     {"model:erk", ode_peer<OdePeer::erk>, "sys:erk(options) -> table",
      "ARKODE, explicit, order 8: as sys:ida."},
     {"model:quad", quad, "sys:quad(options) -> table",
      "Collocation in quadruple precision: end values by name, as texts of 25 digits, and steps."}}};

}  // namespace
}  // namespace pendula::bench

int main(int argc, char** argv) {
  using namespace pendula;
  if (argc < 2) {
    std::fputs("usage: bench_dae script.lua [arguments]\n", stderr);
    return 2;
  }
  const std::unique_ptr<lua_State, decltype(&lua_close)> state(lua::new_state(), lua_close);
  lua::add_module(state.get(), bench::module);
  const std::vector<std::string> arguments(argv + 2, argv + argc);
  shell::set_arguments(state.get(), {argv[0]}, argv[1], arguments);
  return shell::run_file(state.get(), argv[1], arguments);
}
