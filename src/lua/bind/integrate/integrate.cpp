// model:integrate. Reads arguments, calls src/integrate.
#include "lua/bind/integrate/integrate.hpp"

#include <cmath>
#include <cstdio>

#include "base/counted.hpp"
#include "base/text.hpp"
#include "lua/bind/integrate/integrate_options.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/table_text.hpp"
#include "lua/core/values.hpp"
#include "lua/screen/pager.hpp"
#include "lua/screen/terminal.hpp"

namespace pendula::lua {
namespace {

char options_key;  // registry: solution -> the options it was made with, while it lives

/// Pushes a copy of the table at `index`, an absolute one.
void push_copy(lua_State* L, int index) {
  lua_newtable(L);
  for (lua_pushnil(L); lua_next(L, index) != 0;) {
    lua_pushvalue(L, -2);
    lua_insert(L, -2);
    lua_rawset(L, -4);
  }
}

}  // namespace

void remember_options(lua_State* L) {
  if (!lua_istable(L, 2)) return;
  const int solution = lua_gettop(L);
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &options_key) != LUA_TTABLE) {
    lua_pop(L, 1);
    lua_newtable(L);
    lua_newtable(L);
    lua_pushliteral(L, "k");
    lua_setfield(L, -2, "__mode");
    lua_setmetatable(L, -2);
    lua_pushvalue(L, -1);
    lua_rawsetp(L, LUA_REGISTRYINDEX, &options_key);
  }
  lua_pushvalue(L, solution);
  push_copy(L, 2);
  lua_rawset(L, -3);
  lua_settop(L, solution);
}

void report_early_end(Call& call, const char* what, const integrate::Solution& run) {
  if (run.ending() != integrate::Ending::stopped || !typed_at_prompt(call.L)) return;
  warn(text(what, " ", run.status()));
}

namespace {

int integrate_model(Call& call) {
  refuse_after_part();
  const auto model = call.shared<dae::Model>(1, "model");
  const Options options = call.options(2);
  integrate::Simulation simulation = read_simulation(call, options, model);
  const integrate::TrajectoryPtr result = [&] {
    ProgressLine line(std::chrono::milliseconds(500), std::chrono::milliseconds(200));
    const double from = simulation.plan.from, to = simulation.plan.to;
    if (line.has_terminal())
      simulation.plan.progress = [&line, from, to](double t, const integrate::Stats& stats) {
        if (!line.due()) return;
        const auto percent = std::lrint(100 * (t - from) / (to - from));
        line.show(text("integrate: t = ", rounded(t, 5), " of ", rounded(to, 5), " (", percent, " %), ",
                       counted(stats.steps, "step")));
      };
    return integrate::simulate(simulation.start->model, simulation);
  }();
  if (result->solution().ending() == integrate::Ending::interrupted) {
    if (!typed_at_prompt(call.L) || result->solution().t().empty()) throw Interrupted();
    keep_part(call.L);
    std::fprintf(stderr, "\ninterrupted at t = %s; the part computed so far is the result\n",
                 rounded(result->solution().t().back(), 6).c_str());
  }
  report_early_end(call, "integrate:", result->solution());
  call.push(result);
  remember_options(call.L);
  return 1;
}

/// sol.options: a copy, which a script may change freely.
int asked_options(Call& call) {
  lua_rawgetp(call.L, LUA_REGISTRYINDEX, &options_key);
  if (!lua_istable(call.L, -1)) return call.push_nil();
  lua_pushvalue(call.L, 1);
  if (lua_rawget(call.L, -2) == LUA_TTABLE) push_copy(call.L, lua_gettop(call.L));
  return 1;
}

}  // namespace

extern const Module integrate_module = {
    "integrate",
    "Integration",
    {
        {"model:integrate", integrate_model,
         R"(sys:integrate{ start =, to =, rtol =, atol =, method =, dt =, from =, times =, events =, inputs
            =, params =, direct =, sensitivities =, dt0 =, dtmax =, max_steps =, guards = } -> solution)",
         R"(Solves the initial value problem: with dt by fixed steps of any tableau; without, with steps
            chosen so that the error of every step is below atol + rtol |x| (1e-3 rtol and 1e-6 where they are
            not given, less for variables that are small at the start, more for those beyond 1000; a number,
            a list, or { [x] = 1e-9 }), by a method that is chosen and named in stats(), or by "radau", "bdf", "dopri5", "tsit5", "dop853", "rodas", "gauss", "rkc". start is a result
            of init or a table; times: the times to save; inputs: { [u] = function(t) … end, an expression,
            iddata, or samples { t = {…}, u = {…}, hold = "linear" or "zero" } }; events: a list of { when
            = e, direction = -1, 0 or 1, then action = "stop", reset = { [v] = -0.9*v } or call =
            function(sol) … end }; direct = true integrates a model of index 2 or more as it stands; guards
            = false goes on where constraints become dependent or equations lose their unknowns, which
            otherwise ends the run. sol.status says why a run ended early.)",
         R"(
            x = var "x"  sol = dae{ der(x) ~ -2*x }:integrate{ start = { x = 1 }, to = 2, method = rk.rk4, dt = 0.1 }
            print(sol))",
         R"(
            solution by rk4, dt = 0.1: 20 steps from t = 0 to 2, finished
              x  =  0.01831679337)",
         &integrate_option_rows()},
        {"solution#options", asked_options, "sol.options -> table",
         "The options of integrate; nil for a run of a sweep."},
    }};

}  // namespace pendula::lua
