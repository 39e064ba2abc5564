// Saving and restoring solutions: sol:parts(), solution_of_parts(model, options, parts).
#include <optional>

#include "integrate/simulation/problem_setup.hpp"
#include "integrate/solution/pieces.hpp"
#include "lua/bind/integrate/integrate.hpp"
#include "lua/bind/integrate/integrate_options.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {
namespace {

using integrate::Ending;
using integrate::Piece;
using integrate::Point;

constexpr std::pair<Ending, const char*> endings[] = {{Ending::finished, "finished"},
                                                      {Ending::event, "event"},
                                                      {Ending::stop_when, "left"},
                                                      {Ending::interrupted, "interrupted"},
                                                      {Ending::stopped, "stopped"}};

constexpr std::pair<long integrate::Stats::*, const char*> counts[] = {
    {&integrate::Stats::steps, "steps"},
    {&integrate::Stats::rejected, "rejected"},
    {&integrate::Stats::evaluations, "evaluations"},
    {&integrate::Stats::jacobians, "jacobians"},
    {&integrate::Stats::factorisations, "factorisations"},
    {&integrate::Stats::newton_iterations, "newton_iterations"}};

void set_text(lua_State* L, const char* key, const std::string& text) {
  lua_pushlstring(L, text.data(), text.size());
  lua_setfield(L, -2, key);
}
void set_number(lua_State* L, const char* key, double number) {
  lua_pushnumber(L, number);
  lua_setfield(L, -2, key);
}
void set_matrix(lua_State* L, const char* key, Mat matrix) {
  push_matrix(L, std::move(matrix));
  lua_setfield(L, -2, key);
}

Vec stacked(const Point& point, int n, int m) {
  Vec all(2 * n + m);
  all << point.x.head(n), point.xdot.head(n), point.z.head(m);
  return all;
}

/// One column per piece and point: beginning and end of the piece, number of its points, then the values.
Mat table_of(const std::vector<Piece>& pieces) {
  Eigen::Index columns = 0;
  for (const Piece& piece : pieces) columns += piece.values.cols();
  Mat all(3 + pieces.front().values.rows(), columns);
  Eigen::Index at = 0;
  for (const Piece& piece : pieces)
    for (Eigen::Index k = 0; k < piece.values.cols(); ++k)
      all.col(at++) << piece.from, piece.to, static_cast<double>(piece.values.cols()), piece.values.col(k);
  return all.transpose();
}

std::vector<Piece> pieces_in(const Mat& table) {
  std::vector<Piece> pieces;
  for (Eigen::Index at = 0; at < table.rows();) {
    const double count = table(at, 2);
    if (!(count >= 1 && count <= 100 && at + static_cast<Eigen::Index>(count) <= table.rows()))
      throw Error("the pieces of the solution are cut off");
    const auto points = static_cast<Eigen::Index>(count);
    pieces.push_back({table(at, 0), table(at, 1), table.block(at, 3, points, table.cols() - 3).transpose()});
    at += points;
  }
  return pieces;
}

/// One row: t, effect, atol, states.
Mat row_of(const integrate::Regrowth& regrowth) {
  Mat row(1, 3 + static_cast<Eigen::Index>(regrowth.states.size()));
  row(0, 0) = regrowth.t;
  row(0, 1) = static_cast<double>(regrowth.effect);
  row(0, 2) = regrowth.atol;
  for (Eigen::Index k = 3; k < row.cols(); ++k) row(0, k) = regrowth.states[k - 3];
  return row;
}

/// Of n states.
integrate::Regrowth regrowth_in(const Mat& row, int n) {
  using Effect = integrate::Regrowth::Effect;
  integrate::Regrowth regrowth;
  const bool known = row.rows() == 1 && row.cols() > 3 && row(0, 1) >= 0 &&
                     row(0, 1) <= static_cast<double>(Effect::below_numbers);
  if (!known) throw Error("what the solution says about regrowth is cut off");
  regrowth.t = row(0, 0);
  regrowth.effect = static_cast<Effect>(row(0, 1));
  regrowth.atol = row(0, 2);
  for (Eigen::Index k = 3; k < row.cols(); ++k) {
    if (!(row(0, k) >= 0 && row(0, k) < n))
      throw Error("what the solution says about regrowth is of no state");
    regrowth.states.push_back(static_cast<int>(row(0, k)));
  }
  return regrowth;
}

int parts(Call& call) {
  lua_State* L = call.L;
  const auto& solution = call.object<integrate::Trajectory>(1, "solution").solution();
  const int n = solution.problem().visible_n(), m = solution.problem().visible_m();
  lua_newtable(L);
  Mat saved(solution.size(), 1 + 2 * n + m);
  for (int i = 0; i < solution.size(); ++i) {
    const Point point = solution.point(i);
    saved.row(i) << point.t, stacked(point, n, m).transpose();
  }
  set_matrix(L, "points", saved);
  if (const auto pieces = integrate::pieces_of(solution); !pieces.empty())
    set_matrix(L, "pieces", table_of(pieces));
  if (const auto& regrowth = solution.stats().regrowth) set_matrix(L, "regrowth", row_of(*regrowth));
  for (const auto& [ending, name] : endings)
    if (solution.ending() == ending) set_text(L, "ending", name);
  if (solution.ending() == Ending::stopped) set_text(L, "message", solution.status());
  set_text(L, "method", solution.method_name());
  set_number(L, "dt", solution.dt());
  set_number(L, "seconds", solution.cpu_seconds());
  lua_newtable(L);
  for (const auto& [member, name] : counts)
    set_number(L, name, static_cast<double>(solution.stats().*member));
  set_number(L, "errors", solution.errors());
  if (const auto rest = solution.stats().rest) set_number(L, "rest", *rest);
  if (const auto when = solution.passed_growth()) set_number(L, "passed_growth", *when);
  lua_setfield(L, -2, "stats");
  set_text(L, "rounding", solution.rounding());
  set_text(L, "not_unique", solution.not_unique());
  set_text(L, "untested", solution.untested());
  lua_Integer number = 0;
  lua_newtable(L);
  for (const integrate::MethodInUse& use : solution.methods_in_use()) {
    lua_newtable(L);
    set_number(L, "t", use.t);
    set_text(L, "name", use.name);
    set_text(L, "why", use.why);
    lua_rawseti(L, -2, ++number);
  }
  lua_setfield(L, -2, "methods");
  lua_newtable(L);
  number = 0;
  for (const integrate::EventRecord& event : solution.events()) {
    lua_newtable(L);
    set_number(L, "t", event.t);
    set_number(L, "which", event.which + 1);
    set_text(L, "action", event.action);
    set_matrix(L, "before", stacked(event.before, n, m));
    set_matrix(L, "after", stacked(event.after, n, m));
    lua_rawseti(L, -2, ++number);
  }
  lua_setfield(L, -2, "events");
  return 1;
}

Point point_of(double t, const Vec& all, int n, int m) {
  if (all.size() != 2 * n + m)
    throw Error(
        text("a point of the solution has ", all.size(), " numbers, but the model needs ", 2 * n + m));
  return {t, all.head(n), all.segment(n, n), all.tail(m)};
}

Mat matrix_field(Call& call, const Options& options, const char* key) {
  const Mat matrix = to_numeric_matrix(call.L, options.push(key), key);
  lua_pop(call.L, 1);
  return matrix;
}

/// Pushes the tables of a list in turn; field(key) pushes a field of the current one.
template <class Read>
void each_table(Call& call, const Options& options, const char* key, const Read& read) {
  if (!options.has(key)) return;
  lua_State* L = call.L;
  const int list = options.push(key);
  const auto field = [L, list](const char* name) {
    lua_getfield(L, list + 1, name);
    return lua_gettop(L);
  };
  for (lua_Integer i = 1; lua_geti(L, list, i) == LUA_TTABLE; ++i) {
    read(field);
    lua_settop(L, list);
  }
  lua_settop(L, list - 1);
}

void read_lists(Call& call, const Options& options, integrate::Solution& solution, int n, int m) {
  lua_State* L = call.L;
  const auto number = [L](int index, const char* what) { return to_number(L, index, what); };
  each_table(call, options, "events", [&](const auto& field) {
    integrate::EventRecord event;
    event.t = number(field("t"), "t");
    event.which = static_cast<int>(number(field("which"), "which")) - 1;
    event.action = luaL_checkstring(L, field("action"));
    event.before = point_of(event.t, to_numbers(L, field("before"), "before"), n, m);
    event.after = point_of(event.t, to_numbers(L, field("after"), "after"), n, m);
    solution.add_event(std::move(event));
  });
  each_table(call, options, "methods", [&](const auto& field) {
    solution.add_method(
        {number(field("t"), "t"), luaL_checkstring(L, field("name")), luaL_checkstring(L, field("why"))});
  });
}

void read_ending(Call& call, const Options& options, integrate::Solution& solution) {
  integrate::RunOutcome outcome;
  const std::string name = options.string("ending");
  for (const auto& [ending, known] : endings)
    if (name == known) outcome.ending = ending;
  if (outcome.ending == Ending::running) throw Error(text("a solution cannot have ended by '", name, "'"));
  outcome.message = options.string("message", "");
  integrate::Stats stats;
  std::optional<double> passed_growth;
  const int table = options.push("stats");
  if (lua_istable(call.L, table)) {
    const auto number = [&](const char* key) {
      lua_getfield(call.L, table, key);
      const double value = to_number(call.L, lua_gettop(call.L), key);
      lua_pop(call.L, 1);
      return value;
    };
    const auto number_if_any = [&](const char* key) -> std::optional<double> {
      const bool known = lua_getfield(call.L, table, key) != LUA_TNIL;
      lua_pop(call.L, 1);
      return known ? std::optional(number(key)) : std::nullopt;
    };
    for (const auto& [member, key] : counts) stats.*member = static_cast<long>(number(key));
    stats.errors = number_if_any("errors").value_or(0);  // not in files of earlier versions
    stats.rest = number_if_any("rest");
    passed_growth = number_if_any("passed_growth");
  }
  lua_settop(call.L, table - 1);
  if (options.has("regrowth"))
    stats.regrowth = regrowth_in(matrix_field(call, options, "regrowth"), solution.problem().n());
  solution.finish(outcome, stats, options.number("seconds", 0));
  solution.set_passed_growth(passed_growth);
  solution.set_rounding(options.string("rounding", ""));
  solution.set_not_unique(options.string("not_unique", ""));
  solution.set_untested(options.string("untested", ""));
}

/// The result of sol:parts().
const OptionTable part_options = {
    {"points", "matrix", "", "t and the variables, one row per point"},
    {"pieces", "matrix", "", "dense output: polynomials by pieces"},
    {"ending", "string", "", "how the run ended"},
    {"message", "string", "", "why it stopped"},
    {"method", "string", "", "its name"},
    {"dt", "number", "0", "a fixed step, in s"},
    {"seconds", "number", "0", "the time of the run"},
    {"stats", "table", "", "counts, errors and their effect on the run"},
    {"rounding", "string", "", "as in sol:stats()"},
    {"not_unique", "string", "", "as in sol:stats()"},
    {"untested", "string", "", "as in sol:stats()"},
    {"regrowth", "matrix", "", "when, what it did, and which states were smaller than their tolerance"},
    {"events", "list", "", "the events that happened"},
    {"methods", "list", "", "method families used in turn"},
};

/// Restores a solution for evaluation: the model with parameters and inputs, and the computed points.
int solution_of_parts(Call& call) {
  const integrate::Simulation simulation =
      read_simulation(call, call.options(2), call.shared<dae::Model>(1, "model"));
  const dae::ModelPtr& model = simulation.start->model;
  const Options saved = call.options(3, part_options);
  auto solution = std::make_shared<integrate::Solution>(integrate::make_problem(model, simulation));
  const int n = solution->problem().n(), m = solution->problem().m();
  const Mat points = matrix_field(call, saved, "points");
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    solution->save(point_of(points(i, 0), points.row(i).tail(points.cols() - 1), n, m));
  if (saved.has("pieces"))
    solution->set_continuation(
        integrate::continuation_of(pieces_in(matrix_field(call, saved, "pieces")), n, m));
  solution->set_method(saved.string("method"), saved.number("dt", 0));
  read_lists(call, saved, *solution, n, m);
  read_ending(call, saved, *solution);
  call.push(std::make_shared<const integrate::Trajectory>(model, simulation.inputs, std::move(solution),
                                                          simulation.events, std::vector<Expr>{}, nullptr,
                                                          simulation.start));
  remember_options(call.L);
  return 1;
}

}  // namespace

extern const Module solution_parts_module = {
    "integrate",
    "Integration",
    {
        {"solution:parts", parts, "sol:parts() -> table",
         R"(The parts of a solution that save writes: the saved points and, between them, polynomials by pieces (rows of
            from, to, number of points, values), each variable within 1e-10 of its largest size.)",
         "return dae{der(var \"x\") ~ -var \"x\"}:integrate{start = {x = 1}, to = 1}:parts().ending",
         "finished"},
        {"solution_of_parts", solution_of_parts, "solution_of_parts(model, options, parts) -> solution",
         R"(The inverse of sol:parts(): a solution of the model with the options of integrate (start,
            to, params, inputs, events). Nothing is integrated. load uses it.)",
         R"(
            x = var "x"  m = dae{ der(x) ~ -x }
            sol = m:integrate{ start = { x = 1 }, to = 1, rtol = 1e-9 }
            back = solution_of_parts(m, sol.options, sol:parts())
            print(math.abs(back(x, 0.3) - sol(x, 0.3)) < 1e-9))",
         "true", &integrate_option_rows()},
    }};

}  // namespace pendula::lua
