// model:integrate and the type "solution". Reads arguments, calls src/integrate.
#include "lua/lua_integrate.hpp"

#include <cstdio>
#include <cstring>

#include <unistd.h>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "lua/inputs.hpp"
#include "lua/library.hpp"
#include "lua/lua_dae.hpp"
#include "lua/objects.hpp"
#include "lua/values.hpp"

namespace pendula::lua {

struct SolutionStats {
  integrate::Stats counts;
  std::string method, text;
  double seconds;
};
template <>
struct TypeName<SolutionStats> {
  static constexpr const char* value = "stats";
};
template <>
struct TypeName<integrate::Drift> {
  static constexpr const char* value = "drift";
};

namespace {

using integrate::Trajectory;

// ── reading what integrate is given
// ──────────────────────────────────────────────────────────────────────────────

/// method = a tableau or the name of one in rk.
integrate::TableauPtr read_method(Call& call, const Options& options) {
  lua_State* L = call.L;
  if (!options.has("method"))
    throw Error("method is missing; give a tableau, for example method = rk.gauss(2) or rk.rk4");
  int index = options.push("method");
  if (lua_type(L, index) == LUA_TSTRING) {
    const std::string wanted = lua_tostring(L, index);
    push_named(L, "rk." + wanted);
    if (!lua_isuserdata(L, -1))
      throw Error(text("unknown method '", wanted, "'; give a tableau, for example method = rk.gauss(2)"));
    index = lua_gettop(L);
  }
  const auto* held = object_at(L, index, TypeName<integrate::Tableau>::value);
  if (!held)
    throw Error(text("method must be a tableau such as rk.gauss(2) or rk.rk4, got ", describe(L, index)));
  const auto method = std::static_pointer_cast<const integrate::Tableau>(*held);
  lua_settop(L, call.count());
  return method;
}

integrate::Plan read_plan(Call& call, const Options& options, double from) {
  if (!options.has("to") && !options.has("times")) throw Error("the end is missing; give to = 10");
  if (!options.has("dt")) throw Error("the step is missing; give dt = 0.01");
  integrate::Plan plan;
  plan.from = options.number("from", from);
  plan.dt = options.number("dt");
  plan.direct = options.boolean("direct", false);
  if (options.has("times")) {
    const Vec times = to_numbers(call.L, options.push("times"), "times");
    plan.times = std::vector<double>(times.begin(), times.end());
    lua_pop(call.L, 1);
  }
  // Without `to`, the last of `times` is the end; an empty list is refused by integrate() itself.
  const bool last = plan.times && !plan.times->empty();
  plan.to = options.number("to", last ? plan.times->back() : plan.from + 1);
  return plan;
}

/// Parameters: what a start was computed with holds for what begins there, params of this call come first.
dae::ParameterValues read_all_parameters(Call& call, const Options& options, const dae::Model& model) {
  dae::ParameterValues values;
  if (const auto* held = object_at(call.L, options.push("start"), TypeName<dae::Start>::value)) {
    values = parameter_overrides(*std::static_pointer_cast<const dae::Start>(*held));
  }
  if (options.has("params")) {
    for (const auto& [p, value] : read_parameters(call.L, options.push("params"), model, "params"))
      values[p] = value;
  }
  lua_settop(call.L, call.count());
  return values;
}

/// Ctrl-C in a line typed at the prompt: the part computed so far becomes the value of the line. Anywhere
/// else the interrupt goes on and stops the script.
bool typed_at_prompt(lua_State* L) {
  lua_Debug frame;
  if (!isatty(STDIN_FILENO) || lua_getstack(L, 1, &frame) == 0) return false;
  lua_getinfo(L, "S", &frame);
  return std::strcmp(frame.what, "main") == 0 && std::strcmp(frame.source, "=stdin") == 0;
}

int integrate_model(Call& call) {
  const auto model = call.shared<dae::Model>(1, "model");
  const Options options =
      call.options(2, {"start", "from", "to", "dt", "method", "times", "inputs", "params", "direct"});
  integrate::Simulation simulation;
  simulation.method = read_method(call, options);
  simulation.start = read_start(call.L, options, model);
  simulation.plan = read_plan(call, options, simulation.start->t);
  simulation.parameters = read_all_parameters(call, options, *model);
  Inputs inputs = read_inputs(options, *model, call.L);
  simulation.inputs = std::move(inputs.expressions);
  for (NumericInput& input : inputs.numeric)
    simulation.numeric_inputs.emplace_back(input.leaf, std::move(input.value));
  const integrate::TrajectoryPtr result = integrate::simulate(model, simulation);
  if (result->solution().status() == "interrupted") {
    if (!typed_at_prompt(call.L) || result->solution().t().empty()) throw Interrupted();
    interrupt_requested = false;
    std::fprintf(stderr, "\ninterrupted at t = %s; the part computed so far is the result\n",
                 rounded(result->solution().t().back(), 6).c_str());
  }
  return call.push(result);
}

// ── solutions
// ────────────────────────────────────────────────────────────────────────────────────────────────────

const Trajectory& self(Call& call) { return call.object<Trajectory>(1, "solution"); }

/// An expression, a column, or the name of a variable.
MatX read_expression(Call& call, int i) {
  if (lua_type(call.L, i) != LUA_TSTRING) return to_matrix(call.L, i, "expression");
  const std::vector<Expr> known = known_leaves(*self(call).model());
  return column(to_leaves(call.L, i, "expression", known));
}

int push_at(Call& call, const MatX& e, double t) {
  const Vec values = self(call).values(entries(e), t);
  return push_value(call.L, Mat(Eigen::Map<const Mat>(values.data(), e.rows(), e.cols())));
}

int value(Call& call) {
  const MatX e = read_expression(call, 2);
  if (!call.has(3)) return push_matrix(call.L, self(call).values(entries(e)));
  if (is_expression(call.L, 3)) return push_at(call, e, to_number(call.L, 3, "t"));
  const Vec times = to_numbers(call.L, 3, "t");
  Mat rows(times.size(), e.size());
  for (Eigen::Index i = 0; i < times.size(); ++i) rows.row(i) = self(call).values(entries(e), times[i]);
  return push_matrix(call.L, rows);
}

int final(Call& call) {
  const integrate::Point end = self(call).solution().final();
  return call.has(2) ? push_at(call, read_expression(call, 2), end.t) : push_matrix(call.L, Mat(end.x));
}

int times(Call& call) {
  const std::vector<double>& t = self(call).solution().t();
  return push_matrix(call.L, Mat(Eigen::Map<const Vec>(t.data(), static_cast<Eigen::Index>(t.size()))));
}

int status(Call& call) { return call.push(self(call).solution().status()); }

std::string without_newline(const std::string& text) {
  return text.substr(0, text.find_last_not_of('\n') + 1);
}

int solution_text(Call& call) { return call.push(without_newline(self(call).solution().str())); }

int stats(Call& call) {
  const integrate::Solution& solution = self(call).solution();
  return call.push(std::make_shared<const SolutionStats>(
      SolutionStats{solution.stats(), solution.method().name(), without_newline(solution.stats_text()),
                    solution.cpu_seconds()}));
}

int drift(Call& call) { return call.push(std::make_shared<const integrate::Drift>(self(call).drift())); }

// ── statistics and drift
// ─────────────────────────────────────────────────────────────────────────────────────────

const SolutionStats& counted(Call& call) { return call.object<SolutionStats>(1, "stats"); }
int stats_text(Call& call) { return call.push(counted(call).text); }
int stats_method(Call& call) { return call.push(counted(call).method); }
int stats_steps(Call& call) { return call.push(counted(call).counts.steps); }
int stats_evaluations(Call& call) { return call.push(counted(call).counts.evaluations); }
int stats_jacobians(Call& call) { return call.push(counted(call).counts.jacobians); }
int stats_factorisations(Call& call) { return call.push(counted(call).counts.factorisations); }
int stats_newton(Call& call) { return call.push(counted(call).counts.newton_iterations); }
int stats_time(Call& call) { return call.push(counted(call).seconds); }

const integrate::Drift& drifted(Call& call) { return call.object<integrate::Drift>(1, "drift"); }
int drift_text(Call& call) { return call.push(without_newline(drifted(call).str())); }
int drift_length(Call& call) { return call.push(static_cast<long>(drifted(call).rows.size())); }
int drift_verdict(Call& call) { return call.push(drifted(call).verdict()); }

int drift_item(Call& call) {
  const auto& rows = drifted(call).rows;
  const long i = call.integer(2, "index");
  if (i < 1 || i > static_cast<long>(rows.size())) {
    throw Error(text("there are ", rows.size(), " constraints; number ", i, " does not exist"));
  }
  const integrate::DriftRow& row = rows[static_cast<std::size_t>(i - 1)];
  lua_createtable(call.L, 0, 7);
  const auto field = [&](const char* key, double number) {
    lua_pushnumber(call.L, number);
    lua_setfield(call.L, -2, key);
  };
  field("C", row.start[0]);
  if (row.start.size() > 1) field("slope", row.start[1]);
  field("line", row.predicted);
  field("numerical", row.remainder);
  field("largest", row.largest);
  for (const auto& [key, words] :
       {std::pair{"name", row.label}, std::pair{"verdict", verdict_name(row.verdict)}}) {
    lua_pushlstring(call.L, words.data(), words.size());
    lua_setfield(call.L, -2, key);
  }
  return 1;
}

}  // namespace

extern const Module integrate_module;
const Module integrate_module = {
    "integrate",
    "Integration",
    {
        {"model:integrate", integrate_model,
         "sys:integrate{ start =, to =, method =, dt =, from =, times =, inputs =, params =, direct = } -> "
         "solution",
         "Solves the initial value problem with a fixed step and any tableau. start is a result of init or a "
         "table; times: "
         "the times to save; direct = true integrates a model of index 2 or more as it stands. A step that "
         "fails ends the "
         "solution, and sol.status says why.",
         "x = var \"x\"\nsol = dae{ der(x) ~ -2*x }:integrate{ start = { x = 1 }, to = 2, method = rk.rk4, "
         "dt = 0.1 }\n"
         "print(sol)",
         "solution by rk4, dt = 0.1: 20 steps from t = 0 to 2, finished\n  x  =  0.01831679337"},
        {"solution:__call", value, "sol(expression [, t]) -> matrix or number",
         "The values of any expression of the model at the saved times, one row per time, or at time t (a "
         "number or a list).",
         "x = var \"x\"\nsol = dae{ der(x) ~ 2*t }:integrate{ start = { x = 0 }, to = 2, method = "
         "rk.gauss(2), dt = 0.5 }\n"
         "print((\"%.6f\"):format(sol(x^2, 1.5)))",
         "5.062500"},
        {"solution#t", times, "sol.t -> column", "The saved times.", "", ""},
        {"solution#status", status, "sol.status -> string",
         "\"finished\", \"interrupted\", or \"stopped at t = …: why\".", "", ""},
        {"solution:final", final, "sol:final([expression]) -> column or number",
         "The states at the end, in the order of model.differential, or the value of an expression there.",
         "", ""},
        {"solution:stats", stats, "sol:stats() -> stats",
         "Steps, evaluations, Jacobians, factorisations, Newton iterations; .time is the CPU time in "
         "seconds.",
         "", ""},
        {"solution:drift", drift, "sol:drift() -> drift",
         "For each constraint C(0), C′(0), the straight line that an inconsistent start causes, the "
         "numerical part, and the "
         "verdict in words.",
         "", ""},
        {"solution:__tostring", solution_text, "print(sol)", "Method, interval, status and the final values.",
         "", ""},
        {"stats#method", stats_method, "stats.method -> string", "The name of the method.", "", ""},
        {"stats#steps", stats_steps, "stats.steps -> integer", "Steps taken.", "", ""},
        {"stats#evaluations", stats_evaluations, "stats.evaluations -> integer",
         "Evaluations of the equations, one per stage.", "", ""},
        {"stats#jacobians", stats_jacobians, "stats.jacobians -> integer",
         "Evaluations of their Jacobian, one per stage.", "", ""},
        {"stats#factorisations", stats_factorisations, "stats.factorisations -> integer",
         "LU factorisations.", "", ""},
        {"stats#newton", stats_newton, "stats.newton -> integer", "Newton iterations.", "", ""},
        {"stats#time", stats_time, "stats.time -> seconds", "CPU time; differs from run to run.", "", ""},
        {"stats:__tostring", stats_text, "print(sol:stats())", "The counts, without the time.", "", ""},
        {"drift#verdict", drift_verdict, "drift.verdict -> string",
         "\"kept\", \"inconsistent start\", \"numerical drift\", or both, over all constraints.", "", ""},
        {"drift:__index", drift_item, "drift[i] -> table",
         "Constraint i: name, C = C(0), slope = C′(0), line = C(0) + t C′(0) at the end, numerical, largest, "
         "verdict.",
         "", ""},
        {"drift:__len", drift_length, "#drift", "The number of constraints.", "", ""},
        {"drift:__tostring", drift_text, "print(sol:drift())", "The table and the verdicts in words.", "",
         ""},
    }};

}  // namespace pendula::lua
