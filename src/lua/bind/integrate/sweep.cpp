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
#include "lua/bind/integrate/sweep_store.hpp"
#include "lua/core/table_text.hpp"
#include "lua/screen/terminal.hpp"

namespace pendula::lua {

struct SweepRecord {
  std::shared_ptr<const integrate::Sweep> sweep;
  std::shared_ptr<const random::SampleSpace> space;
  std::shared_ptr<const store::RunStore> store;  ///< or null: in memory
};
template <>
struct TypeName<SweepRecord> {
  static constexpr const char* value = "sweep";
};

/// What a sweep has cost, and how it was made.
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

/// "sweep: 120 of 1000 runs, 35/s, 25 s left".
class SweepProgress {
 public:
  explicit SweepProgress(int runs)
      : runs_(runs), line_(std::chrono::seconds(1), std::chrono::milliseconds(0)), begin_(Clock::now()) {}
  void operator()(int done) {
    if (first_ < 0) first_ = done;
    if (done == last_ || !line_.due()) return;
    last_ = done;
    const double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
    const double rate = (done - first_) / seconds;
    std::string out = text("sweep: ", done, " of ", runs_, " runs");
    if (rate > 0) out += text(", ", rounded(rate, 2), "/s, ", rounded((runs_ - done) / rate, 2), " s left");
    line_.show(out);
  }

 private:
  using Clock = std::chrono::steady_clock;
  int runs_, first_ = -1, last_ = -1;
  ProgressLine line_;
  Clock::time_point begin_;
};

/// Goes on with the runs of a store, unless it is only to be opened.
void run_in_store(integrate::Sweep& sweep, const std::shared_ptr<store::RunStore>& store, bool open,
                  bool retry) {
  bool complete = true;
  if (!open) {
    const store::RunStore::Lock lock(*store);
    if (retry) store->forget_failures();
    SweepProgress progress(sweep.runs());
    complete = sweep.run_into(*store, 0, sweep.runs(), [&](int done) { progress(done); });
  } else {
    const auto finished = store->finished();
    complete = std::find(finished.begin(), finished.end(), false) == finished.end();
  }
  sweep.open(integrate::results_in(store), complete);
}

int sweep(Call& call) {
  auto record = std::make_shared<SweepRecord>();
  std::string file;
  bool open = false, retry = false;
  SweepText words;
  if (lua_istable(call.L, 2)) {
    lua_getfield(call.L, 2, "store");
    if (lua_type(call.L, -1) == LUA_TSTRING)
      file = lua_tostring(call.L, -1);
    else if (!lua_isnil(call.L, -1))
      throw Error(text("store must be the name of a file, got ", describe(call.L, -1)));
    lua_getfield(call.L, 2, "open");
    open = lua_toboolean(call.L, -1);
    lua_getfield(call.L, 2, "retry");
    retry = lua_toboolean(call.L, -1);
    lua_settop(call.L, call.count());
    if (file.empty() && (open || retry))
      throw Error("open and retry are for a sweep with store = \"runs.db\"");
    if (!file.empty() && call.is<dae::Model>(1)) words = read_sweep_text(call);
  }
  auto made = std::make_shared<integrate::Sweep>(read_sweep(call, record->space), !file.empty());
  if (file.empty()) {
    SweepProgress progress(made->runs());
    made->run([&](int done) { progress(done); });
  } else {
    auto store = open ? std::make_shared<store::RunStore>(file)
                      : std::make_shared<store::RunStore>(file, describe_store(*made, *record->space, words));
    run_in_store(*made, store, open, retry);
    record->store = std::move(store);
  }
  record->sweep = std::move(made);
  if (!record->sweep->complete() && !open) {
    if (!typed_at_prompt(call.L)) throw Interrupted();
    interrupt_requested = false;
    std::fprintf(stderr, "\ninterrupted; the runs that are done are the result\n");
  }
  return call.push(std::shared_ptr<const SweepRecord>(std::move(record)));
}

/// What a store says about itself.
int store_info(Call& call) {
  const store::RunStore store(call.string(1, "file"));
  const store::Description& d = store.description();
  lua_State* L = call.L;
  lua_newtable(L);
  for (const auto& [key, value] :
       {std::pair{"program", &d.program}, std::pair{"fingerprint", &d.fingerprint},
        std::pair{"model", &d.model}, std::pair{"options", &d.options}, std::pair{"hidden", &d.hidden}}) {
    lua_pushlstring(L, value->data(), value->size());
    lua_setfield(L, -2, key);
  }
  const long failed = static_cast<long>(store.failed().size());
  for (const auto& [key, value] :
       {std::pair{"runs", d.runs}, std::pair{"done", store.done()}, std::pair{"failed", failed}}) {
    lua_pushinteger(L, value);
    lua_setfield(L, -2, key);
  }
  return 1;
}

// ── values ──

const SweepRecord& record_of(Call& call) { return call.object<SweepRecord>(1, "sweep"); }
const integrate::Sweep& sweep_of(Call& call) { return *record_of(call).sweep; }

std::vector<Expr> read_expressions(Call& call, int i) {
  if (lua_type(call.L, i) == LUA_TSTRING)
    return to_leaves(call.L, i, "expression", known_leaves(*sweep_of(call).request().model));
  const MatX e = to_matrix(call.L, i, "expression");
  return {e.data(), e.data() + e.size()};
}

/// At the end of every run, or at time t (argument i + 1).
Mat values(Call& call, int i) {
  const auto expressions = read_expressions(call, i);
  if (!call.has(i + 1)) return sweep_of(call).final(expressions);
  return sweep_of(call).at(expressions, to_number(call.L, i + 1, "t"));
}

int final(Call& call) { return push_matrix(call.L, sweep_of(call).final(read_expressions(call, 2))); }

int value(Call& call) {
  if (call.has(3)) return push_matrix(call.L, values(call, 2));
  const auto expressions = read_expressions(call, 2);
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

int times(Call& call) {
  const auto& t = sweep_of(call).times();
  return push_matrix(call.L, Mat(Eigen::Map<const Vec>(t.data(), static_cast<Eigen::Index>(t.size()))));
}

integrate::SampleStatistics statistics(Call& call) {
  const auto expressions = read_expressions(call, 2);
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

int stats(Call& call) {
  const auto& s = sweep_of(call);
  return call.push(std::make_shared<const SweepStats>(SweepStats{s.counts(), s.runs(), s.lanes(), s.why()}));
}
const SweepStats& counted(Call& call) { return call.object<SweepStats>(1, "stats"); }
int push_count(Call& call, double count) { return call.push(static_cast<long>(count)); }
int stats_runs(Call& call) { return call.push(counted(call).runs); }
int stats_failures(Call& call) { return push_count(call, counted(call).counts.failures); }
int stats_steps(Call& call) { return push_count(call, counted(call).counts.steps); }
int stats_rejected(Call& call) { return push_count(call, counted(call).counts.rejected); }
int stats_evaluations(Call& call) { return push_count(call, counted(call).counts.evaluations); }
int stats_lanes(Call& call) { return call.push(counted(call).lanes); }
int stats_why(Call& call) { return call.push(counted(call).why); }
int stats_text(Call& call) {
  const SweepStats& s = counted(call);
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
    lua_createtable(L, 0, 3);
    lua_pushinteger(L, run + 1);
    lua_setfield(L, -2, "index");
    push_set(L, record_of(call), run);
    lua_setfield(L, -2, "params");
    const std::string why = s.failure(run);
    lua_pushlstring(L, why.data(), why.size());
    lua_setfield(L, -2, "why");
    lua_rawseti(L, -2, ++count);
  }
  return 1;
}

int solution(Call& call) {
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
    expressions = read_expressions(call, 2);
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

/// "1 … 2" of a list, the call that makes a distribution.
std::string range_text(const SweepRecord& record, std::size_t c) {
  const random::Column& column = record.space->columns()[c];
  if (column.distribution) return column.distribution->code();
  if (column.joint) {
    const auto& m = column.joint->mean();
    const double sigma = std::sqrt(column.joint->covariance()(column.component, column.component));
    return text("normal(", shortest(m[column.component]), ", ", rounded(sigma, 6), ") correlated");
  }
  const auto [low, high] = std::minmax_element(column.list.begin(), column.list.end());
  return text(rounded(*low, 6), *low == *high ? "" : " … " + rounded(*high, 6));
}

int sweep_text(Call& call) {
  const SweepRecord& record = record_of(call);
  const auto& s = *record.sweep;
  std::vector<std::string> over;
  const auto& columns = record.space->columns();
  for (std::size_t c = 0; c < columns.size(); ++c)
    over.push_back(text(columns[c].name, " = ", range_text(record, c)));
  const int failed = static_cast<int>(s.counts().failures);
  std::string out = text("sweep of ", s.runs(), s.runs() == 1 ? " run" : " runs", " over ", join(over, ", "),
                         ": ", s.runs() - failed, " finished", failed ? text(", ", failed, " failed") : "",
                         s.complete() ? "" : " (interrupted)", "\n");
  Table lines({false, true, true, true, true});
  lines.row({"at the end", "mean", "std", "min", "max"});
  for (Expr e : unknowns(s)) {
    const integrate::SampleStatistics st = integrate::statistics_of(s, e, {});
    if (st.count)
      lines.row({heading(e), rounded(st.mean, 8), rounded(st.deviation, 6), rounded(st.min, 8),
                 rounded(st.max, 8)});
  }
  if (failed < s.runs()) out += lines.str(2);
  int shown = 0;
  for (int run : s.failures()) {
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
        {"sweep", sweep,
         R"(sweep(sys, { start =, to =, params = { m = {…} }, grid = false, runs =, seed = 0, design = "monte carlo",
            levels =, scramble = "owen", store =, workers =, limit =, lanes =, times =, method =, dt =, rtol =, … })
            -> sweep)",
         R"(Integrates for many parameter values or starts: lists in params and start are paired, grid =
            true takes all combinations (lists in alphabetical order of their names, params before start,
            the last one fastest). Distributions in params and start (normal, lognormal, uniform, triangular, beta,
            discrete, empirical, components of normal(means, covariance), and in params without a name a result of
            fit) are drawn from: runs of them, by design "monte carlo", "latin hypercube", "sobol", "halton", "grid" (levels
            per distribution), "star" (the centre, and levels along each), "saltelli" or "morris" (runs base points or
            trajectories). A run's numbers depend on seed and run only. store = "runs.db": results go into this file
            while they come; the same call again goes on where it stopped, load "runs.db" gives the sweep back
            (docs/store.md); retry = true makes failed runs again; open = true makes none. limit: the seconds that one
            run may take. start is solved anew for each run; start may
            also be a list of starts.
            All options of integrate are understood. The runs are shared among worker processes (workers =
            1: none); a run that fails is listed in s.failures and stops nothing. Lua callbacks see copies
            of the script's variables there. Non-stiff explicit ODEs without events advance 4 or 8 runs at
            a time on SIMD lanes, each with steps of its own (results equal those of integrate to a part of
            the tolerance); s:stats() says so, or why not; lanes = 1 makes one run after another.)",
         "x, k = var \"x\", param \"k\"\n"
         "s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2} }, rtol = "
         "1e-10, atol = 1e-10 })\n"
         "print((\"%.6f %.6f\"):format(s:final(x)[1], s:final(x)[2]))",
         "0.367879 0.135335", &sweep_option_rows()},
        {"store_info", store_info, "store_info(file) -> table",
         R"(What a store of runs holds: runs, done, failed, program, fingerprint, and model and options as Lua text.)",
         R"(
            x, k, file = var "x", param "k", os.tmpname() .. ".db"
            sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2} }, store = file })
            print(store_info(file).done, #load(file)))",
         "2 2"},
        {"sweep:__call", value, "s(e [, t]) -> matrix",
         R"(s(e, t): one row per run at time t, nan where a run failed or ended before. s(e): one row per
            saved time, one column per run, for plot(s.t, s(x)).)",
         "", ""},
        {"sweep:final", final, "s:final(e) -> column",
         "The value at the end of every run; nan where it failed.", "", ""},
        {"sweep#t", times, "s.t -> column", "The saved times: the option times, or about a hundred.", "", ""},
        {"sweep#params", params, "s.params -> table",
         "s.params.m: what varied, one value per run; initial values too.", "", ""},
        {"sweep#names", names, "s.names -> list", "The names of what varied.", "", ""},
        {"sweep#failures", failures, "s.failures -> list",
         R"({ index =, params = { m = … }, why = "…" } of every run that failed.)", "", ""},
        {"sweep:statistics", push_statistics, "s:statistics(e [, t]) -> table",
         "mean, std, min, max and count over the runs that did not fail, at the end or at time t.", "", ""},
        {"sweep:stats", stats, "s:stats() -> sweep_stats",
         R"(How the runs were made and what they cost: runs, failures, steps, rejected, evaluations, lanes,
            why.)",
         R"(
            x, k = var "x", param "k"
            s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2} }, lanes = 1 })
            print(s:stats().why))",
         "one run after another: lanes = 1 was asked for"},
        {"sweep_stats#runs", stats_runs, "stats.runs -> integer", "How many runs.", "", ""},
        {"sweep_stats#failures", stats_failures, "stats.failures -> integer", "Runs that failed.", "", ""},
        {"sweep_stats#steps", stats_steps, "stats.steps -> integer", "Steps of all runs that did not fail.",
         "", ""},
        {"sweep_stats#rejected", stats_rejected, "stats.rejected -> integer",
         "Steps that were tried and repeated.", "", ""},
        {"sweep_stats#evaluations", stats_evaluations, "stats.evaluations -> integer",
         "Evaluations of the equations for these steps.", "", ""},
        {"sweep_stats#lanes", stats_lanes, "stats.lanes -> integer",
         "How many runs advanced together on SIMD lanes; 1: none.", "", ""},
        {"sweep_stats#why", stats_why, "stats.why -> string",
         "In words: lanes and method, or why there were no lanes.", "", ""},
        {"sweep_stats:__tostring", stats_text, "print(s:stats())", "The counts.", "", ""},
        {"sweep:mean", push_mean, "s:mean(e [, t]) -> number", "The mean over the runs.", "", ""},
        {"sweep:std", push_deviation, "s:std(e [, t]) -> number",
         "The standard deviation over the runs (n - 1).", "", ""},
        {"sweep:min", push_least, "s:min(e [, t]) -> number", "The smallest value.", "", ""},
        {"sweep:max", push_greatest, "s:max(e [, t]) -> number", "The largest value.", "", ""},
        {"sweep:table", table, "s:table([expressions]) -> string",
         "One line per run: what varied and the values at the end.", "", ""},
        {"sweep:__index", solution, "s[i] -> solution", "The whole solution of run i (integrated again).", "",
         ""},
        {"sweep:__len", length, "#s", "The number of runs.", "", ""},
        {"sweep:__tostring", sweep_text, "print(s)",
         "Statistics of the final values, and the first failures.", "", ""},
    }};

}  // namespace pendula::lua
