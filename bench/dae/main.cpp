// The program of bench/dae.lua: pendula with one word more, model:ida{…}, the peer on the same model.
#include <cstdio>
#include <memory>

#include "dae/model/first_order.hpp"
#include "expr/graph/derivative.hpp"
#include "ida.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/session/state.hpp"
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
    p.x[k] = value(form.x[i]), p.xdot[k] = value(derivative_leaf(form.x[i]));
  }
  for (std::size_t i = 0; i < form.z.size(); ++i) p.z[static_cast<Eigen::Index>(i)] = value(form.z[i]);
  return p;
}

std::string name_of(Expr leaf) {
  const Symbol& s = symbol_of(leaf);
  return s.name + std::string(static_cast<std::size_t>(s.order), '\'');
}

int ida(Call& call) {
  const auto model = call.shared<dae::Model>(1, "model");
  const lua::Options options = call.options(2, {"start", "to", "rtol", "atol", "sparse", "suppress",
                                                "coefficient", "flush", "inputs", "params", "from"});
  const dae::ConsistentStatePtr start = lua::read_start(call.L, options, model);
  lua_settop(call.L, call.count());
  dae::FirstOrder form = dae::first_order(*model);
  Vec parameters(static_cast<Eigen::Index>(form.p.size()));
  for (std::size_t i = 0; i < form.p.size(); ++i)
    parameters[static_cast<Eigen::Index>(i)] = (*start)(form.p[i]);
  const integrate::Point from = point_of(form, *start);
  integrate::Problem problem(form, parameters);
  IdaOptions o;
  o.to = options.number("to"), o.rtol = options.number("rtol", 1e-6), o.atol = options.number("atol", o.rtol);
  o.sparse = options.boolean("sparse", false), o.suppress_algebraic = options.boolean("suppress", true);
  o.newton_coefficient = options.number("coefficient", 0),
  o.flush_denormals = options.boolean("flush", false);
  const IdaResult result = run_ida(problem, from, o);
  lua_State* L = call.L;
  lua_newtable(L);
  for (Eigen::Index i = 0; i < result.y.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    lua_pushnumber(L, result.y[i]);
    lua_setfield(L, -2, name_of(k < form.x.size() ? form.x[k] : form.z[k - form.x.size()]).c_str());
  }
  const auto set = [&](const char* key, double v) { lua_pushnumber(L, v), lua_setfield(L, -2, key); };
  set("seconds", result.seconds), set("steps", static_cast<double>(result.steps));
  set("residuals", static_cast<double>(result.residuals)),
      set("jacobians", static_cast<double>(result.jacobians));
  if (!result.trouble.empty()) lua_pushstring(L, result.trouble.c_str()), lua_setfield(L, -2, "trouble");
  return 1;
}

const lua::Module module = {
    "ida",
    "The peer",
    {{"model:ida", ida, "sys:ida(options) -> table",
      "IDA of SUNDIALS on the same model: end values by name, seconds, steps, residuals, jacobians."}}};

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
