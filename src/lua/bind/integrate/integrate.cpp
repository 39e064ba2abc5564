// model:integrate and the type "solution". Reads arguments, calls src/integrate.
#include "lua/bind/integrate/integrate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/counted.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/solution/curve.hpp"
#include "lua/bind/integrate/integrate_options.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/table_text.hpp"
#include "lua/core/values.hpp"
#include "lua/screen/terminal.hpp"

namespace pendula::lua {

struct SolutionStats {
  integrate::Stats counts;
  std::string method, text, why, borders, rounding;
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

/// At the prompt a run that did not reach its end says so, and so does what is asked about its last point.
void tell_early_end(Call& call, const char* what, const integrate::Solution& run) {
  if (run.ending() != integrate::Ending::stopped || !typed_at_prompt(call.L)) return;
  std::fflush(stdout);
  std::fprintf(stderr, "warning: %s %s\n", what, run.status().c_str());
}

char options_key;  // registry: solution -> the table of options it was made with, as long as it lives

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
    return integrate::simulate(model, simulation);
  }();
  if (result->solution().ending() == integrate::Ending::interrupted) {
    if (!typed_at_prompt(call.L) || result->solution().t().empty()) throw Interrupted();
    keep_part(call.L);
    std::fprintf(stderr, "\ninterrupted at t = %s; the part computed so far is the result\n",
                 rounded(result->solution().t().back(), 6).c_str());
  }
  tell_early_end(call, "integrate:", result->solution());
  call.push(result);
  remember_options(call.L);
  return 1;
}

/// sol.options: a copy, so that what a script does to it changes nothing.
int asked_options(Call& call) {
  lua_rawgetp(call.L, LUA_REGISTRYINDEX, &options_key);
  if (!lua_istable(call.L, -1)) return lua_pushnil(call.L), 1;
  lua_pushvalue(call.L, 1);
  if (lua_rawget(call.L, -2) == LUA_TTABLE) push_copy(call.L, lua_gettop(call.L));
  return 1;
}

// ── solutions ─────────────────────────────────────────────────────────────────────────────────────────

const Trajectory& trajectory_of(Call& call) { return call.object<Trajectory>(1, "solution"); }

/// Parameters that the model does not know have their default values.
MatX with_defaults(MatX e, const dae::Model& model) {
  Substitution defaults;
  for (Expr leaf : leaves(entries(e))) {
    const Symbol& s = symbol_of(leaf);
    const auto& known = model.parameters;
    if (s.kind == Kind::parameter && s.value && std::find(known.begin(), known.end(), leaf) == known.end() &&
        dae::resolve(model, leaf) == leaf)
      defaults.emplace(leaf, *s.value);
  }
  if (defaults.empty()) return e;
  const std::vector<Expr> replaced = substitute(entries(e), defaults);
  return Eigen::Map<const MatX>(replaced.data(), e.rows(), e.cols());
}

/// An expression, a column, or the name of a variable.
MatX read_expression(Call& call, int i) {
  if (lua_type(call.L, i) != LUA_TSTRING)
    return with_defaults(to_matrix(call.L, i, "expression"), *trajectory_of(call).model());
  const std::vector<Expr> known = known_leaves(*trajectory_of(call).model());
  return column(to_leaves(call.L, i, "expression", known));
}

int push_at(Call& call, const MatX& e, double t) {
  const Vec values = trajectory_of(call).values(entries(e), t);
  return push_value(call.L, Mat(Eigen::Map<const Mat>(values.data(), e.rows(), e.cols())));
}

int value(Call& call) {
  if (call.count() == 2 && lua_type(call.L, 2) == LUA_TNUMBER)
    throw Error(text("expected an expression; the value of x at t = ", luaL_tolstring(call.L, 2, nullptr),
                     " is sol(x, ", luaL_tolstring(call.L, 2, nullptr), ")"));
  const MatX e = read_expression(call, 2);
  if (!call.has(3)) return push_matrix(call.L, trajectory_of(call).values(entries(e)));
  if (is_expression(call.L, 3)) return push_at(call, e, to_number(call.L, 3, "t"));
  const Vec times = to_numbers(call.L, 3, "t");
  Mat rows(times.size(), e.size());
  for (Eigen::Index i = 0; i < times.size(); ++i)
    rows.row(i) = trajectory_of(call).values(entries(e), times[i]);
  return push_matrix(call.L, rows);
}

/// The expressions of a list, a column or a single one, one after the other.
std::vector<Expr> read_expressions(Call& call, int i) {
  std::vector<Expr> all;
  const auto add = [&](const MatX& e) { all.insert(all.end(), entries(e).begin(), entries(e).end()); };
  if (!lua_istable(call.L, i)) {
    add(read_expression(call, i));
    return all;
  }
  const lua_Integer n = luaL_len(call.L, i);
  for (lua_Integer k = 1; k <= n; ++k) {
    lua_geti(call.L, i, k);
    add(read_expression(call, lua_gettop(call.L)));
    lua_pop(call.L, 1);
  }
  return all;
}

/// A pair of numbers, or nothing.
std::optional<std::pair<double, double>> pair_option(Call& call, const Options& o, const char* key) {
  if (!o.has(key)) return {};
  const Vec pair = to_numbers(call.L, o.push(key), key);
  lua_pop(call.L, 1);
  if (pair.size() != 2) throw Error(text("option '", key, "': expected two numbers, got ", pair.size()));
  return std::pair(pair[0], pair[1]);
}

/// The sheet of plot's options.
integrate::CurvePlan curve_plan(Call& call, const Options& o, int columns) {
  integrate::CurvePlan plan;
  const auto coordinates = static_cast<int>(o.integer("coordinates", 0));
  if (coordinates == 0) {
    for (int k = 1; k < columns; ++k) plan.curves.push_back({0, k});
  } else {
    plan.curves.emplace_back();
    for (int k = 0; k < coordinates; ++k) plan.curves[0].push_back(k);
  }
  plan.axes.resize(static_cast<std::size_t>(std::max(2, coordinates)));
  const auto size = pair_option(call, o, "size").value_or(std::pair(800.0, 500.0));
  const char* const limits[] = {"xlim", "ylim", "zlim"};
  for (std::size_t a = 0; a < plan.axes.size(); ++a) {
    plan.axes[a].pixels = a == 0 ? size.first : size.second;
    plan.axes[a].limits = pair_option(call, o, limits[a]);
    if (a < 2) plan.axes[a].log = o.boolean(a == 0 ? "xlog" : "ylog", false);
  }
  return plan;
}

const OptionTable curve_options = {
    {"coordinates", "integer", "", "2 or 3: the expressions are the coordinates of one curve, without t"},
    {"xlim", "list", "", "{ low, high }: the range that is shown"},
    {"ylim", "list", "", "the same of the y axis"},
    {"zlim", "list", "", "the same of the z axis"},
    {"xlog", "boolean", "false", "logarithmic axis"},
    {"ylog", "boolean", "false", "logarithmic axis"},
    {"size", "list", "{800, 500}", "{ width, height } in pixels"},
};

int push_rows(lua_State* L, const std::vector<Eigen::Index>& rows) {
  lua_createtable(L, static_cast<int>(rows.size()), 0);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    lua_pushinteger(L, static_cast<lua_Integer>(rows[k]) + 1);
    lua_rawseti(L, -2, static_cast<lua_Integer>(k) + 1);
  }
  return 1;
}

/// sol:curve(expressions [, options]): columns for plot, where the line is interrupted, what was saved.
int curve(Call& call) {
  std::vector<Expr> wanted = read_expressions(call, 2);
  const Options o = call.options(3);
  const long coordinates = o.integer("coordinates", 0);
  if (coordinates == 0) wanted.insert(wanted.begin(), time_symbol());
  if (coordinates != 0 &&
      (coordinates < 2 || coordinates > 3 || static_cast<std::size_t>(coordinates) != wanted.size()))
    throw Error(
        text("coordinates = ", coordinates, " needs as many expressions, 2 or 3, not ", wanted.size()));
  const std::vector<Expr> known = trajectory_of(call).resolved(wanted);
  const auto points = integrate::curve_points(trajectory_of(call).solution(), known,
                                              curve_plan(call, o, static_cast<int>(known.size())));
  lua_createtable(call.L, static_cast<int>(known.size()), 0);
  for (Eigen::Index j = 0; j < points.values.cols(); ++j) {
    push_matrix(call.L, Mat(points.values.col(j)));
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(j) + 1);
  }
  return 1 + push_rows(call.L, points.breaks) + push_rows(call.L, points.saved);
}

int final(Call& call) {
  tell_early_end(call, "final: the value at the last point; the run", trajectory_of(call).solution());
  const integrate::Point end = trajectory_of(call).solution().final();
  return call.has(2)
             ? push_at(call, read_expression(call, 2), end.t)
             : push_matrix(call.L, Mat(end.x.head(trajectory_of(call).solution().problem().shown_n())));
}

/// sol:sensitivity(expression, parameter [, t])
int sensitivity(Call& call) {
  const MatX e = read_expression(call, 2);
  const Trajectory& run = trajectory_of(call);
  std::vector<Expr> known = known_leaves(*run.model());
  for (Expr p : run.sensitivities()) known.push_back(p);
  const std::vector<Expr> wanted = to_leaves(call.L, 3, "parameter", known);
  if (wanted.empty()) throw Error("the list of parameters is empty; name one, as in sol:sensitivity(x, k)");
  if (wanted.size() != 1 && e.size() != 1)
    throw Error("sensitivity: give one expression or one parameter at a time");
  const auto columns = [&](auto&& values) {
    std::vector<decltype(values(wanted[0]))> list;
    for (Expr p : wanted) list.push_back(values(p));
    return list;
  };
  if (call.has(4) && is_expression(call.L, 4)) {
    const double t = to_number(call.L, 4, "t");
    const auto list = columns([&](Expr p) { return run.sensitivity(entries(e), p, t); });
    if (list.size() == 1)
      return push_value(call.L, Mat(Eigen::Map<const Mat>(list[0].data(), e.rows(), e.cols())));
    Mat row(1, static_cast<Eigen::Index>(list.size()));
    for (Eigen::Index j = 0; j < row.cols(); ++j) row(0, j) = list[j][0];
    return push_matrix(call.L, row);
  }
  if (call.has(4)) {
    const Vec times = to_numbers(call.L, 4, "t");
    Mat result(times.size(), static_cast<Eigen::Index>(std::max(wanted.size(), entries(e).size())));
    for (Eigen::Index i = 0; i < times.size(); ++i) {
      const auto list = columns([&](Expr p) { return run.sensitivity(entries(e), p, times[i]); });
      for (Eigen::Index j = 0; j < result.cols(); ++j)
        result(i, j) = list.size() == 1 ? list[0][j] : list[j][0];
    }
    return push_matrix(call.L, result);
  }
  const auto list = columns([&](Expr p) { return run.sensitivity(entries(e), p); });
  if (list.size() == 1) return push_matrix(call.L, list[0]);
  Mat result(list[0].rows(), static_cast<Eigen::Index>(list.size()));
  for (Eigen::Index j = 0; j < result.cols(); ++j) result.col(j) = list[j].col(0);
  return push_matrix(call.L, result);
}

/// sol:gradient(cost [, {p, …}]): of a cost at the end, by sensitivities if any, else by the adjoint.
int gradient(Call& call) {
  const MatX cost = read_expression(call, 2);
  if (cost.size() != 1) throw Error("the cost must be one number, an expression evaluated at the end");
  const Trajectory& run = trajectory_of(call);
  std::vector<Expr> wanted = run.sensitivities();
  if (call.has(3)) {
    std::vector<Expr> known = known_leaves(*run.model());
    known.insert(known.end(), wanted.begin(), wanted.end());
    known.insert(known.end(), run.model()->parameters.begin(), run.model()->parameters.end());
    wanted = to_leaves(call.L, 3, "parameters", known);
    if (wanted.empty()) throw Error("the list of parameters is empty; without one all of them are meant");
  } else if (wanted.empty()) {
    wanted = run.model()->parameters;
  }
  if (!run.solution().outcome().is_complete())
    throw Error(text("the run has not reached its end: ", run.solution().status()));
  if (run.sensitivities().empty()) return push_matrix(call.L, Mat(run.gradient(cost(0, 0), wanted)));
  Mat result(static_cast<Eigen::Index>(wanted.size()), 1);
  const double end = run.solution().final().t;
  for (Eigen::Index j = 0; j < result.rows(); ++j)
    result(j, 0) = run.sensitivity(entries(cost), wanted[j], end)[0];
  return push_matrix(call.L, result);
}

int times(Call& call) {
  const std::vector<double>& t = trajectory_of(call).solution().t();
  return push_matrix(call.L, Mat(Eigen::Map<const Vec>(t.data(), static_cast<Eigen::Index>(t.size()))));
}

int model(Call& call) { return call.push(trajectory_of(call).model()); }

int solution_status(Call& call) { return call.push(trajectory_of(call).solution().status()); }

int solution_text(Call& call) { return call.push(without_newline(trajectory_of(call).solution().str())); }

int stats(Call& call) {
  const integrate::Solution& solution = trajectory_of(call).solution();
  std::string why;
  for (const integrate::MethodInUse& use : solution.methods_in_use())
    why += text(why.empty() ? "" : "\n", use.name, " from t = ", rounded(use.t, 6), ": ", use.why);
  return call.push(std::make_shared<const SolutionStats>(
      SolutionStats{solution.stats(), solution.method_name(), without_newline(solution.stats_text()), why,
                    without_newline(solution.borders_text()), solution.rounding(), solution.cpu_seconds()}));
}

/// { name = value } of every state and algebraic variable.
void push_values(lua_State* L, const integrate::Problem& problem, const integrate::Point& point) {
  lua_createtable(L, 0, problem.n() + problem.m());
  const auto field = [&](const std::string& name, double value) {
    lua_pushlstring(L, name.data(), name.size());
    lua_pushnumber(L, value);
    lua_rawset(L, -3);
  };
  for (int i = 0; i < problem.shown_n(); ++i) field(problem.x_name(i), point.x[i]);
  for (int i = 0; i < problem.shown_m(); ++i) field(problem.z_name(i), point.z[i]);
}

/// { { t =, which =, action =, values = { x = … }, after = { x = … } }, … }
int events(Call& call) {
  lua_State* L = call.L;
  const integrate::Solution& solution = trajectory_of(call).solution();
  const auto& events = solution.events();
  lua_createtable(L, static_cast<int>(events.size()), 0);
  for (std::size_t i = 0; i < events.size(); ++i) {
    const integrate::EventRecord& event = events[i];
    lua_createtable(L, 0, 6);
    lua_pushnumber(L, event.t);
    lua_setfield(L, -2, "t");
    lua_pushinteger(L, event.which + 1);
    lua_setfield(L, -2, "which");
    lua_pushlstring(L, event.action.data(), event.action.size());
    lua_setfield(L, -2, "action");
    push_values(L, solution.problem(), event.before);
    lua_setfield(L, -2, "values");
    push_values(L, solution.problem(), event.after);
    lua_setfield(L, -2, "after");
    lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
  }
  return 1;
}

/// A list of { t =, states = } or { t =, regime = }.
int switches(Call& call) {
  lua_newtable(call.L);
  int i = 0;
  for (const integrate::StatesInUse& use : trajectory_of(call).solution().states_in_use()) {
    lua_createtable(call.L, 0, 2);
    lua_pushnumber(call.L, use.t);
    lua_setfield(call.L, -2, "t");
    lua_pushlstring(call.L, use.states.data(), use.states.size());
    lua_setfield(call.L, -2, "states");
    lua_rawseti(call.L, -2, ++i);
  }
  for (const integrate::RegimeInUse& use : trajectory_of(call).solution().regimes_in_use()) {
    lua_createtable(call.L, 0, 2);
    lua_pushnumber(call.L, use.t);
    lua_setfield(call.L, -2, "t");
    lua_pushlstring(call.L, use.regime.data(), use.regime.size());
    lua_setfield(call.L, -2, "regime");
    lua_rawseti(call.L, -2, ++i);
  }
  return 1;
}

int drift(Call& call) {
  return call.push(std::make_shared<const integrate::Drift>(trajectory_of(call).drift()));
}

// ── statistics and drift ──────────────────────────────────────────────────────────────────────────────

const SolutionStats& counted(Call& call) { return call.object<SolutionStats>(1, "stats"); }
int stats_text(Call& call) { return call.push(counted(call).text); }
int stats_method(Call& call) { return call.push(counted(call).method); }
int stats_steps(Call& call) { return call.push(counted(call).counts.steps); }
int stats_rejected(Call& call) { return call.push(counted(call).counts.rejected); }
int stats_evaluations(Call& call) { return call.push(counted(call).counts.evaluations); }
int stats_jacobians(Call& call) { return call.push(counted(call).counts.jacobians); }
int stats_factorisations(Call& call) { return call.push(counted(call).counts.factorisations); }
int stats_newton(Call& call) { return call.push(counted(call).counts.newton_iterations); }
int stats_why(Call& call) { return call.push(counted(call).why); }
int stats_borders(Call& call) { return call.push(counted(call).borders); }
int stats_rounding(Call& call) { return call.push(counted(call).rounding); }
int stats_time(Call& call) { return call.push(counted(call).seconds); }

const integrate::Drift& drifted(Call& call) { return call.object<integrate::Drift>(1, "drift"); }
int drift_text(Call& call) { return call.push(without_newline(drifted(call).str())); }
int drift_length(Call& call) { return call.push(static_cast<long>(drifted(call).rows.size())); }
int drift_verdict(Call& call) { return call.push(drifted(call).verdict()); }

int drift_item(Call& call) {
  const auto& rows = drifted(call).rows;
  const long i = call.integer(2, "index");
  if (i < 1 || i > static_cast<long>(rows.size())) {
    throw Error(
        text(rows.size() == 1 ? "there is 1 constraint" : text("there are ", rows.size(), " constraints"),
             "; number ", i, " does not exist"));
  }
  const integrate::DriftRow& row = rows[i - 1];
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

extern const Module integrate_module = {
    "integrate",
    "Integration",
    {
        {"model:integrate", integrate_model,
         R"(sys:integrate{ start =, to =, rtol =, atol =, method =, dt =, from =, times =, events =, inputs
            =, params =, direct =, sensitivities =, dt0 =, dtmax =, max_steps =, guards = } -> solution)",
         R"(Solves the initial value problem: with dt by fixed steps of any tableau; without, with steps
            chosen so that the error of every step is below atol + rtol |x| (1e-3 rtol and 1e-6 where they are
            not given, less for variables that are small at the start; a number, a list, or { [x] = 1e-9 }), by a method that is chosen and named in
            stats(), or by "radau", "bdf", "dopri5", "tsit5", "dop853", "rodas", "gauss", "rkc". start is a result
            of init or a table; times: the times to save; inputs: { [u] = function(t) … end, an expression,
            iddata, or samples { t = {…}, u = {…}, hold = "linear" or "zero" } }; events: a list of { when
            = e, direction = -1, 0 or 1, then action = "stop", reset = { [v] = -0.9*v } or call =
            function(sol) … end }; direct = true integrates a model of index 2 or more as it stands; guards
            = false goes on where constraints become dependent or equations lose their unknowns, which
            otherwise ends the run. What ends a run early is in sol.status.)",
         R"(
            x = var "x"
            sol = dae{ der(x) ~ -2*x }:integrate{ start = { x = 1 }, to = 2, method = rk.rk4, dt = 0.1 }
            print(sol))",
         R"(
            solution by rk4, dt = 0.1: 20 steps from t = 0 to 2, finished
              x  =  0.01831679337)",
         &integrate_option_rows()},
        {"solution:__call", value, "sol(expression [, t]) -> matrix or number",
         R"(The values of any expression of the model at the saved times, one row per time, or at time t (a
            number or a list).)",
         R"(
            x = var "x"
            sol = dae{ der(x) ~ 2*t }:integrate{ start = { x = 0 }, to = 2, method = rk.gauss(2), dt = 0.5 }
            print(("%.6f"):format(sol(x^2, 1.5))))",
         "5.062500"},
        {"solution:curve", curve, "sol:curve(expressions [, options]) -> list of columns, rows, rows",
         "What plot draws: columns t, e₁, e₂ … with rows so close that lines between them are off by a fraction of "
         "a pixel; the rows before which a jump interrupts the line; the rows that are saved points. With "
         "coordinates = 2 or 3 the expressions are the coordinates of one curve, without t. xlim, ylim, zlim, "
         "xlog, ylog and size are those of the figure.",
         "return #dae{der(var \"x\") ~ -var \"x\"}:integrate{start = {x = 1}, to = 1}:curve \"x\"", "2",
         &curve_options},
        {"solution#t", times, "sol.t -> column", "The saved times.", "", ""},
        {"solution#model", model, "sol.model -> model", "The model that was integrated.", "", ""},
        {"solution#options", asked_options, "sol.options -> table",
         "What integrate was asked for; nil for a run of a sweep.", "", ""},
        {"solution#status", solution_status, "sol.status -> string",
         R"("finished", "event", "interrupted", or "stopped at t = …: why".)", "", ""},
        {"solution#events", events, "sol.events -> list",
         R"(One entry per event in order of time: t, which (its number in the list of events), action,
            values before and after it by name.)",
         R"(
            y, v = vars "y v"
            sol = dae{ der(y) ~ v, der(v) ~ -2 }:integrate{ start = { y = 1, v = 0 }, to = 9,
              events = { { when = y, action = "stop" } } }
            print(("%s %.6f %.6f"):format(sol.status, sol.events[1].t, sol.events[1].values.v)))",
         "event 1.000000 -2.000000"},
        {"solution:final", final, "sol:final([expression]) -> column or number",
         "The states at the end, in the order of model.differential, or the value of an expression there.",
         R"(x = var "x"  sol = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1 }
return ("%.4f"):format(sol:final(x)))",
         "0.3679"},
        {"solution:sensitivity", sensitivity,
         "sol:sensitivity(expression, parameter [, t]) -> column or number",
         R"(The derivative of any expression along the solution with respect to a parameter, or to the
            initial value of a state, that was named in sensitivities = { … } when the model was
            integrated: at the saved times, or at time t. Exact variational equations, under the same error
            control.)",
         R"(
            x, k = var "x", param "k"
            sol = dae{ der(x) ~ -k*x }:integrate{ start = { x = 1 }, to = 2, params = { k = 0.5 },
              sensitivities = { k, x }, rtol = 1e-10 }
            print(("%.6f %.6f"):format(sol:sensitivity(x, k, 2), sol:sensitivity(x, x, 2))))",
         "-0.735759 0.367879"},
        {"solution:gradient", gradient, "sol:gradient(cost [, { parameters }]) -> column",
         R"(The gradient of an expression at the end of the solution with respect to parameters, and states
            that stand for their initial values: by the discrete adjoint of the Runge–Kutta steps that were
            taken, one sweep backwards however many parameters there are (exact for the computed numbers,
            with dt; all parameters, if none are named). With sensitivities = { … } when the model was
            integrated, from these. An integral as a cost is one more state: der(J) ~ x^2.)",
         "x, k = var \"x\", param \"k\"\n"
         "sol = dae{ der(x) ~ -k*x }:integrate{ start = { x = 1 }, to = 2, params = { k = 0.5 }, rtol = "
         "1e-10 }\n"
         "print((\"%.6f %.6f\"):format(sol:gradient(x^2, { k, x })[1], sol:gradient(x^2, { k, x })[2]))",
         "-0.541341 0.270671"},
        {"solution:stats", stats, "sol:stats() -> stats",
         R"(Steps, evaluations, Jacobians, factorisations, Newton iterations; .time is the CPU time in
            seconds.)",
         R"(x = var "x"  sol = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1 }
return sol:stats().steps > 1)",
         "true"},
        {"solution:switches", switches, "sol:switches() -> list of { t =, states = } or { t =, regime = }",
         R"(Form "dummy": which states were in use from when on. The first entry is the choice at the
            start, every further one a switch to a choice that was clearly better there.
            Models whose regimes differ in index (0 ~ min(a, b)): which regime held from when on.)",
         "", ""},
        {"solution:drift", drift, "sol:drift() -> drift",
         R"(For each constraint C(0), C′(0), the straight line that an inconsistent start causes, the
            numerical part, and the verdict in words.)",
         R"(x, y, z = vars "x y z"
sol = dae{ der(x) ~ y, der(y) ~ z, 0 ~ x - sin(t) }:reduce "project":integrate{ start = {}, to = 1 }
return sol:drift())",
         ""},
        {"solution:__tostring", solution_text, "print(sol)", "Method, interval, status and the final values.",
         "", ""},
        {"stats#method", stats_method, "stats.method -> string", "The name of the method.", "", ""},
        {"stats#steps", stats_steps, "stats.steps -> integer", "Steps taken.", "", ""},
        {"stats#rejected", stats_rejected, "stats.rejected -> integer",
         "Steps that were tried and repeated with a smaller one (adaptive runs).", "", ""},
        {"stats#evaluations", stats_evaluations, "stats.evaluations -> integer",
         "Evaluations of the equations, one per stage.", "", ""},
        {"stats#jacobians", stats_jacobians, "stats.jacobians -> integer",
         "Evaluations of their Jacobian, one per stage.", "", ""},
        {"stats#factorisations", stats_factorisations, "stats.factorisations -> integer",
         "LU factorisations.", "", ""},
        {"stats#newton", stats_newton, "stats.newton -> integer", "Newton iterations.", "", ""},
        {"stats#time", stats_time, "stats.time -> seconds", "CPU time; differs from run to run.", "", ""},
        {"stats#borders", stats_borders, "stats.borders -> string",
         "How the borders of abs, sign, min, max and ifelse were treated, a line each: smooth (both sides agree "
         "in value and slope) and kink (in value): located, or integrated through where that costs less; jump "
         "or kink (not decided by the expressions): located.",
         "dae{ der(var 'x') ~ 2 - abs(var 'x') }:integrate{ start = { x = -1 }, to = 3 }:stats().borders",
         "border x = 0: kink, located 1 time"},
        {"stats#rounding", stats_rounding, "stats.rounding -> string",
         "Why the digits asked for are not there: rounding errors of the equations beside the tolerances (implicit "
         "methods, rtol below 1e-7). Empty where they are harmless.",
         "", ""},
        {"stats#why", stats_why, "stats.why -> string",
         "The choices of the method, one line each: from which time on, which method, and why.", "", ""},
        {"stats:__tostring", stats_text, "print(sol:stats())", "The counts, without the time.", "", ""},
        {"drift#verdict", drift_verdict, "drift.verdict -> string",
         R"("kept", "inconsistent start", "numerical drift", or both, over all constraints.)", "", ""},
        {"drift:__index", drift_item, "drift[i] -> table",
         R"(Constraint i: name, C = C(0), slope = C′(0), line = C(0) + t C′(0) at the end, numerical,
            largest, verdict.)",
         "", ""},
        {"drift:__len", drift_length, "#drift", "The number of constraints.", "", ""},
        {"drift:__tostring", drift_text, "print(sol:drift())", "The table and the verdicts in words.", "",
         ""},
    }};

}  // namespace pendula::lua
