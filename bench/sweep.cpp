// A sweep of 1000 pendulums over 10 s at rtol 1e-8, as a user types it: start, symbolic preparation,
// integration and about a hundred saved times per run. Time per sweep; the last argument is the number of
// worker processes (0: all processors).
#include <cstdio>
#include <cstdlib>
#include <string>

#include <benchmark/benchmark.h>

#include "lua/state.hpp"

namespace {

void run(lua_State* L, const std::string& script) {
  if (luaL_loadbuffer(L, script.data(), script.size(), "=bench") != LUA_OK || !pendula::lua::run(L, 0, 0)) {
    std::fprintf(stderr, "%s\n", lua_tostring(L, -1));
    std::exit(1);
  }
}

void example_sweep_pendulums(benchmark::State& state) {
  lua_State* L = pendula::lua::new_state();
  run(L,
      "theta = var 'theta'\n"
      "m, g, l = params 'm=1 g=9.81 l=1'\n"
      "pendulum = dae { m*l^2*der(theta, 2) ~ -m*g*l*sin(theta) }\n"
      "options = { start = { theta = 2, [theta.dot] = 0 }, to = 10, rtol = 1e-8, atol = 1e-8,\n"
      "            params = { l = linspace(1, 2, 1000) } }\n");
  if (state.range(0) > 0) run(L, "options.workers = " + std::to_string(state.range(0)));
  for (auto _ : state) run(L, "assert(#sweep(pendulum, options).failures == 0)");
  state.counters["runs/s"] = benchmark::Counter(1000, benchmark::Counter::kIsIterationInvariantRate);
  lua_close(L);
}
BENCHMARK(example_sweep_pendulums)->Arg(1)->Arg(0)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
