// A sweep of 1000 parameter sets as a user types it, and the same sets by the steppers alone.
//
//   script     sweep(…) from Lua: starts, preparation, integration and the ends (or a hundred saved times
//   each);
//              `lanes`: 1 run after another, or on SIMD lanes; one process, or all processors
//   steppers   the integrations alone, one core, no times between: the ordinary stepper, the ensemble with
//   one
//              lane, with 4 (AVX2) and with 8 (AVX-512). Tolerances are equal, and the steps are.
//
// The last lines are the ratios of the steppers: one lane ÷ the widest.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>

#include <benchmark/benchmark.h>

#include "dae/model/first_order.hpp"
#include "integrate/run/adaptive_run.hpp"
#include "integrate/run/methods.hpp"
#include "integrate/sweep/ensemble.hpp"
#include "lua/bind/integrate/integrate_options.hpp"
#include "lua/session/state.hpp"

namespace {

using namespace pendula;
using namespace pendula::integrate;

// ── as a user types it ──

void run(lua_State* L, const std::string& script) {
  if (luaL_loadbuffer(L, script.data(), script.size(), "=bench") != LUA_OK || !lua::run(L, 0, 0)) {
    std::fprintf(stderr, "%s\n", lua_tostring(L, -1));
    std::exit(1);
  }
}

/// Arguments: lanes (0: as many as pay), workers (0: all processors), saved times.
void example_sweep_pendulums(benchmark::State& state) {
  lua_State* L = lua::new_state();
  run(L,
      "theta = var 'theta'\n"
      "m, g, l = params 'm=1 g=9.81 l=1'\n"
      "pendulum = dae { m*l^2*der(theta, 2) ~ -m*g*l*sin(theta) }\n"
      "options = { start = { theta = 2, [theta.dot] = 0 }, to = 10, rtol = 1e-8, atol = 1e-8,\n"
      "            params = { l = linspace(1, 2, 1000) } }\n");
  if (state.range(0) > 0) run(L, "options.lanes = " + std::to_string(state.range(0)));
  if (state.range(1) > 0) run(L, "options.workers = " + std::to_string(state.range(1)));
  run(L, "options.times = linspace(0, 10, " + std::to_string(state.range(2)) + ")");
  for (auto _ : state) run(L, "assert(#sweep(pendulum, options).failures == 0)");
  state.counters["runs/s"] = benchmark::Counter(1000, benchmark::Counter::kIsIterationInvariantRate);
  lua_close(L);
}
BENCHMARK(example_sweep_pendulums)
    ->ArgNames({"lanes", "workers", "times"})
    ->Args({1, 1, 2})
    ->Args({0, 1, 2})
    ->Args({1, 0, 2})
    ->Args({0, 0, 2})
    ->Args({1, 1, 101})
    ->Args({0, 1, 101})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// ── the steppers ──

constexpr int sets = 1000;
Expr variable(const char* name) { return symbol(Kind::variable, name); }

struct Case {
  dae::FirstOrder form;
  std::vector<double> start;
  double to, low, high;  ///< the parameter
};

Case make(std::vector<Expr> x, std::vector<Expr> f, std::vector<double> start, double to, double low,
          double high) {
  Case c;
  c.form.x = std::move(x), c.form.f = std::move(f);
  for (std::size_t i = 0; i < c.form.x.size(); ++i) {
    c.form.xdot.push_back(derivative_leaf(c.form.x[i]));
    c.form.F.push_back(c.form.xdot[i] - c.form.f[i]);
  }
  c.form.p = {symbol(Kind::parameter, "p")}, c.form.semi_explicit = true;
  c.start = std::move(start), c.to = to, c.low = low, c.high = high;
  return c;
}

const std::map<std::string, Case>& cases() {
  const Expr x = variable("x"), y = variable("y"), z = variable("z"), p = symbol(Kind::parameter, "p");
  static const std::map<std::string, Case> all = {
      {"pendulum", make({x, y}, {y, Expr(-9.81) / p * sin(x)}, {2, 0}, 10, 1, 2)},
      {"lotka_volterra", make({x, y}, {p * x - x * y, x * y - y}, {2, 1}, 20, 0.5, 2)},
      {"van_der_pol", make({x, y}, {y, p * (1 - x * x) * y - x}, {2, 0}, 20, 0.5, 1.5)},
      {"lorenz",
       make({x, y, z}, {10 * (y - x), x * (p - z) - y, x * y - Expr(8) / 3 * z}, {1, 1, 1}, 5, 20, 28)}};
  return all;
}

double parameter(const Case& c, int set) { return c.low + (c.high - c.low) * set / (sets - 1); }
Tolerances tolerances(const Case& c) {
  return Tolerances::uniform(static_cast<int>(c.form.x.size()), 1e-8, 1e-8);
}

TableauPtr verner87() {
  static const TableauPtr tableau = [] {
    lua_State* L = lua::new_state();
    const TableauPtr found = lua::automatic_method(L).explicit_choice[0];
    lua_close(L);
    return found;
  }();
  return tableau;
}

std::map<std::string, std::map<int, double>>& seconds() {
  static std::map<std::string, std::map<int, double>> all;
  return all;
}

class Ends : public EnsembleClient {
 public:
  explicit Ends(const Case& c) : c_(c) {}
  std::optional<int> next(double* x, double* p) override {
    if (next_ == sets) return {};
    std::copy(c_.start.begin(), c_.start.end(), x), p[0] = parameter(c_, next_);
    return next_++;
  }
  void point(int, std::optional<int>, double, const double* x, const double*, const double*) override {
    sum += x[0];
  }
  void finished(int, const Stats& stats) override { steps += stats.steps; }
  void abandoned(int) override { std::abort(); }
  double sum = 0;
  long steps = 0;

 private:
  const Case& c_;
  int next_ = 0;
};

/// lanes: 0 is the ordinary stepper.
void steppers(benchmark::State& state, const std::string& name, int lanes) {
  const Case& c = cases().at(name);
  const auto problem = std::make_shared<Problem>(c.form, Vec::Constant(1, c.low));
  double sum = 0, best = 1e9;
  long steps = 0;
  for (auto _ : state) {
    const auto begin = std::chrono::steady_clock::now();
    if (lanes > 0) {
      EnsemblePlan plan;
      plan.to = c.to, plan.dt_max = std::numeric_limits<double>::infinity(), plan.most_steps = 1e6;
      plan.rtol = tolerances(c).rtol, plan.atol = tolerances(c).atol;
      Ends ends(c);
      const FlushDenormals guard;
      Ensemble(CompiledLaneStep::make(*problem, *verner87(), true, lanes), plan).run(ends);
      sum = ends.sum, steps = ends.steps;
    } else {
      sum = 0, steps = 0;
      Method method;
      method = method_of(verner87());
      Plan plan;
      plan.to = c.to, plan.tolerances = tolerances(c), plan.times = std::vector{c.to};
      for (int set = 0; set < sets; ++set) {
        const auto own = std::make_shared<Problem>(c.form, Vec::Constant(1, parameter(c, set)));
        Point start;
        start.x = Eigen::Map<const Vec>(c.start.data(), static_cast<Eigen::Index>(c.start.size()));
        const auto solution = integrate_adaptive(own, method, start, plan);
        sum += solution->final().x[0], steps += solution->stats().steps;
      }
    }
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  seconds()[name][lanes] = best;
  state.counters["sum of ends"] = sum;
  state.counters["steps"] = static_cast<double>(steps);
}

void print_ratios() {
  std::printf("\n%-16s %12s %12s %12s %12s %20s %16s\n", "1000 sets, 1 core", "ordinary", "1 lane", "4 lanes",
              "8 lanes", "1 lane ÷ widest", "ordinary ÷ widest");
  for (const auto& [name, times] : seconds()) {
    if (!times.count(0) || !times.count(1)) continue;
    const double widest = times.rbegin()->second;
    std::printf("%-17s", name.c_str());
    for (int lanes : {0, 1, 4, 8})
      std::printf(times.count(lanes) ? " %9.2f ms" : "            -",
                  times.count(lanes) ? 1e3 * times.at(lanes) : 0);
    std::printf(" %19.1f %17.1f\n", times.at(1) / widest, times.at(0) / widest);
  }
}

}  // namespace

int main(int argc, char** argv) {
  for (const auto& [name, c] : cases())
    for (int lanes : {0, 1, 4, 8})
      if (lanes <= 1 || codegen::Machine::available(lanes))
        benchmark::RegisterBenchmark(("steppers/" + name + "/lanes:" + std::to_string(lanes)).c_str(),
                                     [name = name, lanes](benchmark::State& s) { steppers(s, name, lanes); })
            ->Unit(benchmark::kMillisecond);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  print_ratios();
  return 0;
}
