// The type "solution": values, curves, final values, sensitivities, events.
#include <algorithm>

#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/truncated_text.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/solution/curve.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/bind/integrate/event_list.hpp"
#include "lua/bind/integrate/integrate.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/table_text.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {
namespace {

using integrate::Trajectory;

const Trajectory& trajectory_of(Call& call) { return call.object<Trajectory>(1, "solution"); }

/// Replaces parameters that the model does not contain by their default values.
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

/// The expressions of a list, a column or a single one, concatenated.
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

/// The drawing area according to the options of plot.
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

/// sol:curve(expressions [, options]): columns for plot, the interruptions of the line, and the saved points.
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
  report_early_end(call, "final: the value at the last point; the run", trajectory_of(call).solution());
  const integrate::Point end = trajectory_of(call).solution().final();
  return call.has(2)
             ? push_at(call, read_expression(call, 2), end.t)
             : push_matrix(call.L, Mat(end.x.head(trajectory_of(call).solution().problem().visible_n())));
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

/// sol:gradient(cost [, {p, …}]): of a cost at the end, by sensitivities if there are any, else
/// by the adjoint.
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

/// "drive.brake" of drive.brake.mode, "" of x.
std::string path_of(Expr leaf) {
  const std::string& name = symbol_of(leaf).name;
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? "" : name.substr(0, dot);
}

/// The common prefix of both paths.
std::string common_path(std::string a, const std::string& b) {
  while (!a.empty() && b != a && b.compare(0, a.size() + 1, a + ".") != 0) {
    const std::size_t dot = a.rfind('.');
    a.resize(dot == std::string::npos ? 0 : dot);
  }
  return a;
}

/// The part of a composed model that an event belongs to: that of the states it resets, or of its condition.
std::string part_of(const integrate::ModelEvent& event) {
  std::vector<Expr> all;
  for (const auto& [state, value] : event.reset) all.push_back(state);
  if (all.empty())
    for (Expr leaf : leaves(std::vector{event.when}))
      if (symbol_of(leaf).kind != Kind::time) all.push_back(leaf);
  if (all.empty()) return "";
  std::string path = path_of(all[0]);
  for (Expr leaf : all) path = common_path(path, path_of(leaf));
  return path;
}

const integrate::ModelEvent* asked_event(const Trajectory& trajectory, const integrate::EventRecord& event) {
  const auto which = static_cast<std::size_t>(event.which);
  return which < trajectory.events().size() ? &trajectory.events()[which] : nullptr;
}

/// Describes an event that the caller did not request: " of C" for an event of a part; " of the model:
/// h = 0".
std::string origin_text(const Trajectory& trajectory, const integrate::ModelEvent& event) {
  if (const std::string part = part_of(event); !part.empty()) return " of " + part;
  for (const dae::Model* m = trajectory.model().get(); m; m = m->parent.get())
    for (const dae::Transition& own : m->events)
      if (own.when == event.when) return text(" of the model: ", dae::truncated_text(own.when), " = 0");
  return "";
}

int solution_text(Call& call) {
  const Trajectory& trajectory = trajectory_of(call);
  const integrate::Solution& solution = trajectory.solution();
  std::string out = solution.str();
  if (solution.ending() == integrate::Ending::event && !solution.events().empty())
    if (const auto* asked = asked_event(trajectory, solution.events().back()); asked != nullptr)
      out.insert(out.find('\n'), origin_text(trajectory, *asked));
  if (const std::size_t line = out.find('\n'); line != std::string::npos && trajectory.start())
    out.insert(line + 1, trajectory.start()->unchosen_roots_text());
  return call.push(without_newline(out));
}

/// { name = value } of every state and algebraic variable.
void push_values(lua_State* L, const integrate::Problem& problem, const integrate::Point& point) {
  lua_createtable(L, 0, problem.n() + problem.m());
  const auto field = [&](const std::string& name, double value) {
    lua_pushlstring(L, name.data(), name.size());
    lua_pushnumber(L, value);
    lua_rawset(L, -3);
  };
  for (int i = 0; i < problem.visible_n(); ++i) field(problem.x_name(i), point.x[i]);
  for (int i = 0; i < problem.visible_m(); ++i) field(problem.z_name(i), point.z[i]);
}

/// Sets the fields when and part of the table on top of the stack.
void push_origin(lua_State* L, const integrate::ModelEvent& event) {
  push_expr(L, event.when);
  lua_setfield(L, -2, "when");
  const std::string part = part_of(event);
  if (part.empty()) return;
  lua_pushlstring(L, part.data(), part.size());
  lua_setfield(L, -2, "part");
}

/// { { t =, which =, when =, part =, action =, values = { x = … }, after = { x = … } }, … }
int events(Call& call) {
  lua_State* L = call.L;
  const Trajectory& trajectory = trajectory_of(call);
  const integrate::Solution& solution = trajectory.solution();
  const auto& events = solution.events();
  lua_createtable(L, static_cast<int>(events.size()), 0);
  for (std::size_t i = 0; i < events.size(); ++i) {
    const integrate::EventRecord& event = events[i];
    lua_createtable(L, 0, 8);
    lua_pushnumber(L, event.t);
    lua_setfield(L, -2, "t");
    if (const auto* asked = asked_event(trajectory, event); asked != nullptr) push_origin(L, *asked);
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
  make_event_list(L);
  return 1;
}

/// Appends { t =, [name] = text } to the list on top of the stack.
void append_switch(lua_State* L, double t, const char* name, const std::string& text) {
  lua_createtable(L, 0, 2);
  lua_pushnumber(L, t);
  lua_setfield(L, -2, "t");
  lua_pushlstring(L, text.data(), text.size());
  lua_setfield(L, -2, name);
  lua_rawseti(L, -2, static_cast<lua_Integer>(lua_rawlen(L, -2)) + 1);
}

/// A list of { t =, states = } or { t =, regime = }.
int switches(Call& call) {
  const integrate::Solution& solution = trajectory_of(call).solution();
  lua_newtable(call.L);
  for (const integrate::StatesInUse& use : solution.states_in_use())
    append_switch(call.L, use.t, "states", use.states);
  for (const integrate::RegimeInUse& use : solution.regimes_in_use())
    append_switch(call.L, use.t, "regime", use.regime);
  return 1;
}

}  // namespace

extern const Module solution_module = {
    "integrate",
    "Integration",
    {
        {"solution:__call", value, "sol(expression [, t]) -> matrix or number",
         R"(The values of any expression of the model at the saved times, one row per time, or at time t (a
            number or a list).)",
         R"(
            x = var "x"  sol = dae{ der(x) ~ 2*t }:integrate{ start = { x = 0 }, to = 2, method = rk.gauss(2), dt = 0.5 }
            print(("%.6f"):format(sol(x^2, 1.5))))",
         "5.062500"},
        {"solution:curve", curve, "sol:curve(expressions [, options]) -> list of columns, rows, rows",
         "The curve as plot draws it: columns t, e₁, e₂ … with rows so close that lines between them are off by a fraction of "
         "a pixel; the rows before which a jump interrupts the line; the rows that are saved points. With "
         "coordinates = 2 or 3 the expressions are the coordinates of one curve, without t. xlim, ylim, zlim, "
         "xlog, ylog and size are those of the figure.",
         "return #dae{der(var \"x\") ~ -var \"x\"}:integrate{start = {x = 1}, to = 1}:curve \"x\"", "2",
         &curve_options},
        {"solution#t", times, "sol.t -> column", "The saved times."},
        {"solution#model", model, "sol.model -> model", "The model that was integrated."},
        {"solution#status", solution_status, "sol.status -> string",
         R"("finished", "event", "interrupted", or "stopped at t = …: why".)"},
        {"solution#events", events, "sol.events -> list",
         R"(One entry per event in order of time: t, which (its number in the list of events), when (the
            expression that became 0), part (in models of parts the path of the part), action, values
            before and after it by name. print(sol.events) is a table of times, numbers and conditions.)",
         R"(
            y, v = vars "y v"  sol = dae{ der(y) ~ v, der(v) ~ -2 }:integrate{ start = { y = 1, v = 0 }, to = 9,
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
         "sol = dae{ der(x) ~ -k*x }:integrate{ start = { x = 1 }, to = 2, "
         "params = { k = 0.5 }, rtol = 1e-10 }\n"
         "print((\"%.6f %.6f\"):format(sol:gradient(x^2, { k, x })[1], sol:gradient(x^2, { k, x })[2]))",
         "-0.541341 0.270671"},
        {"solution:switches", switches, "sol:switches() -> list of { t =, states = } or { t =, regime = }",
         R"(Form "dummy": which states were in use from when on. The first entry is the choice at the
            start, every further one a switch to a choice that was clearly better there.
            Models whose regimes differ in index (0 ~ min(a, b)): which regime held from when on.)",
         R"(x, y, z = vars "x y z"  low = dae{ der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }:reduce "dummy"
at = low:init{ fix = { x = 1, [y.dot] = 0 }, guess = { y = 0 } }
return #low:integrate{ start = at, to = 2 }:switches())",
         "4"},
        {"solution:__tostring", solution_text, "print(sol)",
         "Method, interval, status and the final values."},
    }};

}  // namespace pendula::lua
