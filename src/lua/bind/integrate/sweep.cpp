// sweep(sys, …) and the type "sweep". Reads arguments, calls src/integrate.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "integrate/sweep/sample_statistics.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/bind/expr/expr.hpp"
#include "lua/bind/integrate/integrate.hpp"
#include "lua/bind/integrate/sweep_options.hpp"
#include "lua/bind/integrate/sweep_record.hpp"
#include "lua/bind/integrate/sweep_store.hpp"
#include "lua/core/table_text.hpp"
#include "lua/screen/terminal.hpp"

namespace pendula::lua {

/// The cost of a sweep and the way it was executed.
struct SweepStats {
  integrate::Sweep::Counts counts;
  int runs, lanes;
  std::string why;
};
template <>
struct TypeName<SweepStats> {
  static constexpr const char* value = "sweep_stats";
};

namespace {

// ── values ──

const SweepRecord& record_of(Call& call) { return call.object<SweepRecord>(1, "sweep"); }
const integrate::Sweep& sweep_of(Call& call) { return *record_of(call).sweep; }

std::vector<Expr> read_sweep_expressions(Call& call, int i) {
  if (lua_type(call.L, i) == LUA_TSTRING)
    return to_leaves(call.L, i, "expression", known_leaves(*sweep_of(call).request().model));
  const MatX e = to_matrix(call.L, i, "expression");
  return {e.data(), e.data() + e.size()};
}

/// Values at the end of every run, or at time t (argument i + 1).
Mat values(Call& call, int i) {
  const auto expressions = read_sweep_expressions(call, i);
  if (!call.has(i + 1)) return sweep_of(call).final(expressions);
  return sweep_of(call).at(expressions, to_number(call.L, i + 1, "t"));
}

int sweep_final(Call& call) {
  return push_matrix(call.L, sweep_of(call).final(read_sweep_expressions(call, 2)));
}

int sweep_value(Call& call) {
  if (call.has(3)) return push_matrix(call.L, values(call, 2));
  const auto expressions = read_sweep_expressions(call, 2);
  if (expressions.size() != 1)
    throw Error(
        "s(e) takes one expression (its columns are the runs); for several at one time write s(e, t)");
  const auto& times = sweep_of(call).times();
  if (times.empty())
    throw Error("only the ends were kept; give times = linspace(0, 10, 101), or ask for s(e, t)");
  Mat table(static_cast<Eigen::Index>(times.size()), sweep_of(call).runs());
  for (std::size_t k = 0; k < times.size(); ++k)
    table.row(static_cast<Eigen::Index>(k)) =
        sweep_of(call).at_saved(expressions, static_cast<int>(k)).transpose();
  return push_matrix(call.L, table);
}

int sweep_times(Call& call) {
  const auto& t = sweep_of(call).times();
  return push_matrix(call.L, Mat(Eigen::Map<const Vec>(t.data(), static_cast<Eigen::Index>(t.size()))));
}

integrate::SampleStatistics statistics(Call& call) {
  const auto expressions = read_sweep_expressions(call, 2);
  if (expressions.size() != 1) throw Error(text("expected one expression, got ", expressions.size()));
  std::optional<double> t;
  if (call.has(3)) t = to_number(call.L, 3, "t");
  const integrate::SampleStatistics s = integrate::statistics_of(sweep_of(call), expressions[0], t);
  if (s.count == 0) throw Error("no run has a value there: see s.failures");
  return s;
}
int push_mean(Call& call) { return call.push(statistics(call).mean); }
int push_deviation(Call& call) { return call.push(statistics(call).deviation); }
int push_least(Call& call) { return call.push(statistics(call).min); }
int push_greatest(Call& call) { return call.push(statistics(call).max); }
int push_statistics(Call& call) {
  const integrate::SampleStatistics s = statistics(call);
  lua_createtable(call.L, 0, 5);
  for (const auto& [key, number] : {std::pair{"mean", s.mean}, std::pair{"std", s.deviation},
                                    std::pair{"min", s.min}, std::pair{"max", s.max}}) {
    lua_pushnumber(call.L, number);
    lua_setfield(call.L, -2, key);
  }
  lua_pushinteger(call.L, s.count);
  lua_setfield(call.L, -2, "count");
  return 1;
}

int stats_of_sweep(Call& call) {
  const auto& s = sweep_of(call);
  return call.push(std::make_shared<const SweepStats>(SweepStats{s.counts(), s.runs(), s.lanes(), s.why()}));
}
const SweepStats& sweep_counted(Call& call) { return call.object<SweepStats>(1, "stats"); }
int push_count(Call& call, double count) { return call.push(static_cast<long>(count)); }
int stats_runs(Call& call) { return call.push(sweep_counted(call).runs); }
int stats_failures(Call& call) { return push_count(call, sweep_counted(call).counts.failures); }
int sweep_stats_steps(Call& call) { return push_count(call, sweep_counted(call).counts.steps); }
int sweep_stats_rejected(Call& call) { return push_count(call, sweep_counted(call).counts.rejected); }
int sweep_stats_evaluations(Call& call) { return push_count(call, sweep_counted(call).counts.evaluations); }
int stats_lanes(Call& call) { return call.push(sweep_counted(call).lanes); }
int sweep_stats_why(Call& call) { return call.push(sweep_counted(call).why); }
int sweep_stats_text(Call& call) {
  const SweepStats& s = sweep_counted(call);
  Table lines({false, true});
  lines.row({"runs", std::to_string(s.runs)});
  for (const auto& [name, count] :
       {std::pair{"failures", s.counts.failures}, std::pair{"steps", s.counts.steps},
        std::pair{"rejected", s.counts.rejected}, std::pair{"evaluations", s.counts.evaluations}})
    lines.row({name, std::to_string(static_cast<long>(count))});
  return call.push(text(s.why, "\n", without_newline(lines.str(2))));
}

int length(Call& call) { return call.push(sweep_of(call).runs()); }

void push_set(lua_State* L, const SweepRecord& record, int run) {
  lua_newtable(L);
  const auto& columns = record.space->columns();
  for (std::size_t c = 0; c < columns.size(); ++c) {
    lua_pushnumber(L, record.space->value(c, run));
    lua_setfield(L, -2, columns[c].name.c_str());
  }
}

int params(Call& call) {
  lua_newtable(call.L);
  const random::SampleSpace& space = *record_of(call).space;
  for (std::size_t c = 0; c < space.columns().size(); ++c) {
    Mat values(space.runs(), 1);
    for (long run = 0; run < space.runs(); ++run) values(run, 0) = space.value(c, run);
    push_matrix(call.L, std::move(values));
    lua_setfield(call.L, -2, space.columns()[c].name.c_str());
  }
  return 1;
}

/// The names of the axes in their order, for s:plot().
int names(Call& call) {
  lua_newtable(call.L);
  const auto& columns = record_of(call).space->columns();
  for (std::size_t c = 0; c < columns.size(); ++c) {
    lua_pushstring(call.L, columns[c].name.c_str());
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(c) + 1);
  }
  return 1;
}

int failures(Call& call) {
  lua_State* L = call.L;
  const auto& s = sweep_of(call);
  lua_newtable(L);
  lua_Integer count = 0;
  for (int run : s.failures()) {
    lua_createtable(L, 0, 4);
    lua_pushinteger(L, run + 1);
    lua_setfield(L, -2, "index");
    push_set(L, record_of(call), run);
    lua_setfield(L, -2, "params");
    const std::string why = s.failure(run);
    lua_pushlstring(L, why.data(), why.size());
    lua_setfield(L, -2, "why");
    const std::string again = record_of(call).store
                                  ? text("load(\"", record_of(call).store->file(), "\")[", run + 1, "]")
                                  : text("s[", run + 1, "]");
    lua_pushlstring(L, again.data(), again.size());
    lua_setfield(L, -2, "call");
    lua_rawseti(L, -2, ++count);
  }
  return 1;
}

int sweep_solution(Call& call) {
  const long i = call.integer(2, "index");
  const auto& s = sweep_of(call);
  if (i < 1 || i > s.runs())
    throw Error(text("there are ", s.runs(), " runs; number ", i, " does not exist"));
  return call.push(s.trajectory(static_cast<int>(i - 1)));
}

// ── text ──

std::string set_text(const SweepRecord& record, int run) {
  std::vector<std::string> parts;
  const auto& columns = record.space->columns();
  for (std::size_t c = 0; c < columns.size(); ++c)
    parts.push_back(text(columns[c].name, " = ", rounded(record.space->value(c, run), 6)));
  return join(parts, ", ");
}

std::vector<Expr> unknowns(const integrate::Sweep& s) {
  std::vector<Expr> all = s.request().model->states();
  const auto algebraic = s.request().model->algebraic();
  all.insert(all.end(), algebraic.begin(), algebraic.end());
  if (all.size() > 6) all.resize(6);
  return all;
}

std::string heading(Expr e) { return leaf_name(e); }

int table(Call& call) {
  const SweepRecord& record = record_of(call);
  const auto& s = *record.sweep;
  std::vector<Expr> expressions = unknowns(s);
  std::vector<std::string> head;
  const auto& columns = record.space->columns();
  for (const random::Column& column : columns) head.push_back(column.name);
  if (call.has(2)) {
    expressions = read_sweep_expressions(call, 2);
    for (Expr e : expressions) head.push_back(e.is_symbol() ? heading(e) : to_text(e));
  } else {
    for (Expr e : expressions) head.push_back(heading(e));
  }
  const Mat end = s.final(expressions);
  Table lines(std::vector<bool>(head.size() + 1, true));
  head.insert(head.begin(), "run");
  lines.row(head);
  for (int run = 0; run < s.runs(); ++run) {
    std::vector<std::string> row = {std::to_string(run + 1)};
    for (std::size_t c = 0; c < columns.size(); ++c) row.push_back(rounded(record.space->value(c, run), 6));
    for (Eigen::Index j = 0; j < end.cols(); ++j)
      row.push_back(s.done(run) ? rounded(end(run, j), 8) : j == 0 ? "failed" : "");
    lines.row(row);
  }
  const std::string out = lines.str();
  return call.push(out.substr(0, out.size() - 1));
}

std::string first_line(const std::string& message) { return message.substr(0, message.find('\n')); }

/// "1 … 2" for a list, the constructor call for a distribution.
std::string range_text(const SweepRecord& record, std::size_t c) {
  const random::Column& column = record.space->columns()[c];
  if (column.distribution) return column.distribution->code();
  if (column.joint) {
    const auto& m = column.joint->mean();
    const double sigma = std::sqrt(column.joint->covariance()(column.component, column.component));
    return text("normal(", rounded(m[column.component], 6), ", ", rounded(sigma, 6), ") correlated");
  }
  const auto [low, high] = std::minmax_element(column.list.begin(), column.list.end());
  return text(rounded(*low, 6), *low == *high ? "" : " … " + rounded(*high, 6));
}

int sweep_text(Call& call) {
  const SweepRecord& record = record_of(call);
  const auto& s = *record.sweep;
  std::vector<std::string> over;
  const auto& columns = record.space->columns();
  constexpr std::size_t most = 8;
  const std::size_t told = columns.size() > most ? most - 2 : columns.size();
  for (std::size_t c = 0; c < told; ++c) over.push_back(text(columns[c].name, " = ", range_text(record, c)));
  if (told < columns.size()) over.push_back(text(columns.size() - told, " more"));
  std::vector<int> failures = s.failures();
  // drop runs that were not made
  if (!s.complete()) std::erase_if(failures, [&](int run) { return s.failure(run).empty(); });
  const int failed = static_cast<int>(failures.size()), done = static_cast<int>(s.counts().done);
  const int left = s.runs() - done - failed;
  std::string out = text("sweep of ", s.runs(), s.runs() == 1 ? " run" : " runs", " over ", join(over, ", "),
                         ": ", done, " finished", failed ? text(", ", failed, " failed") : "",
                         left ? text(", ", left, " not made") : "", "\n");
  Table lines({false, true, true, true, true});
  lines.row({"at the end", "mean", "std", "min", "max"});
  for (Expr e : unknowns(s)) {
    const integrate::SampleStatistics st = integrate::statistics_of(s, e, {});
    if (st.count)
      lines.row({heading(e), rounded(st.mean, 8), rounded(st.deviation, 6), rounded(st.min, 8),
                 rounded(st.max, 8)});
  }
  if (done > 0) out += lines.str(2);
  int shown = 0;
  for (int run : failures) {
    if (++shown > 5) break;
    out +=
        text("  failed: run ", run + 1, " (", set_text(record, run), "): ", first_line(s.failure(run)), "\n");
  }
  shown = std::min(shown, 5);
  if (failed > shown) out += text("  … ", failed - shown, " more in s.failures\n");
  return call.push(out.substr(0, out.size() - 1));
}

}  // namespace

extern const Module sweep_module = {
    "sweep",
    "Parameter sweeps",
    {
        {"sweep:__call", sweep_value, "s(e [, t]) -> matrix",
         R"(s(e, t): one row per run at time t, nan where a run failed or ended before. s(e): one row per
            saved time, one column per run, for plot(s.t, s(x)).)",
         R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             s(x).cols, ("%.4f"):format(s(x, 0.5)[1]))",
         "3 0.6065"},
        {"sweep:final", sweep_final, "s:final(e) -> column",
         "The value at the end of every run; nan where it failed.", R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             print(("%.4f %.4f %.4f"):format(s:final(x)[1], s:final(x)[2], s:final(x)[3])))",
         "0.3679 0.1353 0.0498"},
        {"sweep#t", sweep_times, "s.t -> column", "The saved times: the option times, or about a hundred.",
         "", ""},
        {"sweep#params", params, "s.params -> table",
         "s.params.m: the values of a varied parameter, one per run; initial values too.", "", ""},
        {"sweep#names", names, "s.names -> list", "The names of the varied parameters and initial values.",
         "", ""},
        {"sweep#failures", failures, "s.failures -> list",
         R"({ index =, params = { m = … }, why = "…", call = "s[17]" } of every run that failed; the call, where s is the
            sweep, makes that run again, as far as it came.)",
         "", ""},
        {"sweep:statistics", push_statistics, "s:statistics(e [, t]) -> table",
         "The fields mean, std, min, max and count over the runs that did not fail, at the end or at time t.",
         R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             st = s:statistics(x)
             st.count, ("%.4f ± %.4f"):format(st.mean, st.std))",
         "3 0.1843 ± 0.1646"},
        {"sweep:stats", stats_of_sweep, "s:stats() -> sweep_stats",
         R"(How the runs were made, and their cost: runs, failures, steps, rejected, evaluations, lanes,
            why.)",
         R"(
            x, k = var "x", param "k"
            s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2} }, lanes = 1 })
            print(s:stats().why))",
         "one run after another: lanes = 1 was asked for"},
        {"sweep_stats#runs", stats_runs, "stats.runs -> integer", "How many runs.", "", ""},
        {"sweep_stats#failures", stats_failures, "stats.failures -> integer", "Runs that failed.", "", ""},
        {"sweep_stats#steps", sweep_stats_steps, "stats.steps -> integer",
         "Steps of all runs that did not fail.", "", ""},
        {"sweep_stats#rejected", sweep_stats_rejected, "stats.rejected -> integer",
         "Steps that were tried and repeated.", "", ""},
        {"sweep_stats#evaluations", sweep_stats_evaluations, "stats.evaluations -> integer",
         "Evaluations of the equations for these steps.", "", ""},
        {"sweep_stats#lanes", stats_lanes, "stats.lanes -> integer",
         "How many runs advanced together on SIMD lanes; 1: none.", "", ""},
        {"sweep_stats#why", sweep_stats_why, "stats.why -> string",
         "In words: lanes and method, or why there were no lanes.", "", ""},
        {"sweep_stats:__tostring", sweep_stats_text, "print(s:stats())", "The counts.", "", ""},
        {"sweep:mean", push_mean, "s:mean(e [, t]) -> number", "The mean over the runs.", R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             print(("%.4f"):format(s:mean(x))))",
         "0.1843"},
        {"sweep:std", push_deviation, "s:std(e [, t]) -> number",
         "The standard deviation over the runs (n - 1).", R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             print(("%.4f"):format(s:std(x))))",
         "0.1646"},
        {"sweep:min", push_least, "s:min(e [, t]) -> number", "The smallest value.", R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             print(("%.4f"):format(s:min(x))))",
         "0.0498"},
        {"sweep:max", push_greatest, "s:max(e [, t]) -> number", "The largest value.", R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             print(("%.4f"):format(s:max(x, 0.5))))",
         "0.6065"},
        {"sweep:table", table, "s:table([expressions]) -> string",
         "One line per run: the varied parameters and the values at the end.", R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             s:table{ x, k*x })",
         R"(
             run  k            x         k x
               1  1   0.36787944  0.36787944
               2  2   0.13533528  0.27067057
               3  3  0.049787068   0.1493612)"},
        {"sweep:__index", sweep_solution, "s[i] -> solution",
         "The whole solution of run i (integrated again).", R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
             print(("%.4f"):format(s[2](x, 0.5))))",
         "0.3679"},
        {"sweep:__len", length, "#s", "The number of runs.", "", ""},
        {"sweep:__tostring", sweep_text, "print(s)",
         "Statistics of the final values, and the first failures.", "", ""},
    }};

}  // namespace pendula::lua
