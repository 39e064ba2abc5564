// What bench/instructions.sh counts under callgrind: fixed pieces of work, each inside counted_section().
// Everything is warm when it is counted (the same work was done before), so that kernels and machine
// code are there.
//     bench_instructions <folder of problems.lua> [case]      without a case: the names
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <random>
#include <string>

#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/state_reselection.hpp"
#include "integrate/solve/linear_solver.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/core/objects.hpp"
#include "lua/session/state.hpp"

using namespace pendula;
using namespace pendula::integrate;

/// callgrind counts inside this function alone: --toggle-collect='counted_section*'.
[[gnu::noinline]] void counted_section(const std::function<void()>& work) {
  work();
  asm volatile("" ::: "memory");
}

namespace {

std::string folder;

void run(lua_State* L, const std::string& script) {
  if (luaL_loadbuffer(L, script.data(), script.size(), "=bench") != LUA_OK || !lua::run(L, 0, 0)) {
    std::fprintf(stderr, "%s\n", lua_tostring(L, -1));
    std::exit(1);
  }
}

/// Counted once it is warm: programs of steps are made when a run or two have asked for them.
void count(const std::function<void()>& work) {
  for (int k = 0; k < 4; ++k) work();
  counted_section(work);
}

/// 100 evaluations of the residual and the exact Jacobian of the model that the script leaves in `model`.
void kernel(lua_State* L, const std::string& script) {
  run(L, script);
  lua_getglobal(L, "model");
  const auto* held = lua::object_at(L, -1, "model");
  if (!held) std::exit(1);
  const auto problem = make_problem(std::static_pointer_cast<const dae::Model>(*held), Simulation{});
  problem->accelerate();
  const Vec x = Vec::Constant(problem->n(), 0.3), z = Vec::Constant(problem->m(), 0.2);
  std::vector<double> F(static_cast<std::size_t>(problem->n() + problem->m()));
  count([&] {
    for (int k = 0; k < 100; ++k) {
      problem->set_point(0.01 * k, x.data(), x.data(), z.data());
      problem->residual(F.data());
      problem->jacobian();
    }
  });
}

/// 100 factorisations and solutions, about `per_row` entries per row.
void factorisation(int n, int per_row, LinearSolver<double>::Factorisation way) {
  std::mt19937 random(1);
  std::vector<Position> positions;
  std::vector<double> values, b(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < per_row; ++k) {
      positions.push_back({i, k == 0   ? i
                              : k == 1 ? (i + 1) % n
                                       : static_cast<int>(random() % static_cast<unsigned>(n))});
      values.push_back(k == 0 ? 4 : 0.5 + 1e-9 * static_cast<double>(random()));
    }
  LinearSolver<double> solver;
  solver.analyse(n, positions, way);
  count([&] {
    for (int k = 0; k < 100; ++k) {
      if (!solver.factorise(values.data())) std::exit(1);
      std::fill(b.begin(), b.end(), 1.0);
      solver.solve(b.data());
    }
  });
}

/// One integration of a problem of problems.lua at rtol = 1e-6; the end alone is saved.
void integration(lua_State* L, const std::string& script) {
  run(L, "problems = {} for _, p in ipairs(assert(loadfile '" + folder + "/problems.lua')('" + folder +
             "/')) do problems[p.name] = p end\n"
             "function prepare(name, to) local p = problems[name] local m = p.model(p)\n"
             "  local model = p.ours and p.ours(m) or m:index() > 1 and m:reduce() or m\n"
             "  local atol = p.atol and p.atol(1e-6) or 1e-6\n"
             "  return function() local sol = model:integrate { start = p.start, to = to or p.to, rtol = "
             "1e-6, atol = atol,\n"
             "    times = { to or p.to } } assert(sol.status == 'finished', sol.status) end end\n" +
             script);
  count([&] { run(L, "work()"); });
}

using Case = std::function<void(lua_State*)>;
const std::vector<std::pair<std::string, Case>>& cases() {
  using Factorisation = LinearSolver<double>::Factorisation;
  static const auto problem = [](const std::string& name, const std::string& to = "nil") {
    return [=](lua_State* L) { integration(L, "work = prepare('" + name + "', " + to + ")"); };
  };
  static const std::vector<std::pair<std::string, Case>> all = {
      {"kernel_exam1",
       [](lua_State* L) {
         kernel(L,
                "local q = var('q', 6)\nlocal p1, p2 = q:slice(1, 3), q:slice(4, 6)\n"
                "model = lagrange { q = q, T = q.dot.T*q.dot/2, V = 9.81*(p1[3] + p2[3]),\n"
                "  C = { (p1.T*p1 - 1)/2, (norm(p2 - p1)^2 - 1/4)/2 } }:reduce 'acc'");
       }},
      {"kernel_squeezer", [](lua_State* L) { kernel(L, "model = problems.squeezer()"); }},
      {"kernel_chain100",
       [](lua_State* L) {
         kernel(L, "for _, p in ipairs(assert(loadfile '" + folder + "/problems.lua')('" + folder +
                       "/')) do if p.name == 'chain of 1000 links' then chain = p end end\n"
                       "model = chain.sized(100).model():reduce 'acc'");
       }},
      {"lu_dense20", [](lua_State*) { factorisation(20, 4, Factorisation::dense); }},
      {"lu_straight60", [](lua_State*) { factorisation(60, 4, Factorisation::straight); }},
      {"lu_klu300", [](lua_State*) { factorisation(300, 4, Factorisation::sparse); }},
      {"run_pendulum", problem("pendulum, index 3")},
      {"run_car_axis", problem("car axis, index 3")},
      {"run_akzo", problem("chemical Akzo Nobel")},
      {"run_transistor", problem("transistor amplifier", "0.02")},
      {"run_hires", problem("HIRES")},
      {"run_robertson", problem("Robertson DAE, t = 4e7")},
      {"run_chain100",
       [](lua_State* L) {
         integration(
             L, "problems.chain = problems['chain of 1000 links'].sized(100) work = prepare('chain', 0.1)");
       }},
      {"run_diodes300",
       [](lua_State* L) {
         integration(L,
                     "problems.diodes = problems['diodes, 10^3 nodes'].sized(300) work = prepare('diodes')");
       }},
      {"sweep_lanes",
       [](lua_State* L) {
         run(L,
             "local th, l = var 'th', param('l', 1)\n"
             "local m = dae { der(th, 2) ~ -9.81/l*sin(th) }\n"
             "function work() return sweep(m, { start = { th = 2, [th.dot] = 0 }, to = 10, rtol = 1e-6, atol "
             "= 1e-6,\n"
             "  lanes = 4, workers = 1, times = { 10 }, params = { l = linspace(1, 2, 64) } }) end");
         count([&] { run(L, "work()"); });
       }},
  };
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::puts("bench_instructions: ./dev count counts the instructions of fixed pieces of work");
    return 0;
  }
  folder = argv[1];
  for (const auto& [name, work] : cases()) {
    if (argc == 2) {
      std::cout << name << '\n';
    } else if (name == argv[2]) {
      lua_State* L = lua::new_state();
      work(L);
      std::fflush(nullptr);
      std::_Exit(0);
    }
  }
  return argc == 2 ? 0 : 2;
}
