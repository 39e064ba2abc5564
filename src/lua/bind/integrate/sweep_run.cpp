// sweep(sys, …): makes the runs or delegates them, and store_info. Reads arguments, calls src/integrate.
#include <algorithm>
#include <cstdio>

#include "base/text.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/bind/integrate/integrate.hpp"
#include "lua/bind/integrate/sweep_options.hpp"
#include "lua/bind/integrate/sweep_record.hpp"
#include "lua/bind/integrate/sweep_store.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/screen/terminal.hpp"

namespace pendula::lua {
namespace {

/// Continues the runs of a store, unless it is only opened.
void run_in_store(integrate::Sweep& sweep, const std::shared_ptr<store::RunStore>& store, bool open,
                  bool retry) {
  bool complete = true;
  if (!open) {
    const store::RunStore::Lock lock(*store);
    if (retry) store->forget_failures();
    CountProgress progress("sweep", "runs", sweep.runs());
    complete = sweep.run_into(*store, 0, sweep.runs(), [&](int done) { progress(done); });
  } else {
    const auto finished = store->finished();
    complete = std::find(finished.begin(), finished.end(), false) == finished.end();
  }
  sweep.open(integrate::results_in(store), complete);
}

/// Where the runs are made, if not in this process.
struct RemoteExecution {
  long shards = 0;        ///< number of shards written for manual execution
  int slurm = LUA_NOREF;  ///< reference to the table of slurm{ … }
};

RemoteExecution read_remote_execution(Call& call, const std::string& file) {
  RemoteExecution result;
  if (!lua_istable(call.L, 2)) return result;
  lua_getfield(call.L, 2, "shards");
  if (!lua_isnil(call.L, -1)) {
    result.shards = lua_isinteger(call.L, -1) ? static_cast<long>(lua_tointeger(call.L, -1)) : 0;
    if (result.shards < 1) throw Error("shards must be a whole number of at least 1");
  }
  lua_getfield(call.L, 2, "on");
  const bool given = !lua_isnil(call.L, -1);
  if (given && object_type(call.L, lua_gettop(call.L)) != "slurm")
    throw Error(text("on must be slurm{ … }, got ", describe(call.L, -1)));
  if (given) result.slurm = luaL_ref(call.L, LUA_REGISTRYINDEX);
  lua_settop(call.L, call.count());
  if (file.empty() && (given || result.shards > 0))
    throw Error("a sweep that other processes make needs a file for its results: store = \"runs.db\"");
  return result;
}

/// Writes shards for manual execution, or submits them to Slurm and waits.
void run_remotely(Call& call, const store::RunStore& store, const RemoteExecution& elsewhere) {
  lua_State* L = call.L;
  include_embedded(L, "many/cluster");
  lua_getfield(L, -1, elsewhere.slurm == LUA_NOREF ? "write" : "run");
  lua_pushlstring(L, store.file().data(), store.file().size());
  if (elsewhere.slurm == LUA_NOREF)
    lua_pushinteger(L, elsewhere.shards);
  else
    lua_rawgeti(L, LUA_REGISTRYINDEX, elsewhere.slurm);
  protected_call(L, 2, 0);
  lua_settop(L, call.count());
}

/// Replaces random processes among the inputs by expressions with random parameters, and from = fit
/// by its params.
void expand_options(Call& call) {
  lua_State* L = call.L;
  if (!lua_istable(L, 2)) return;
  lua_getfield(L, 2, "from");
  bool found = object_type(L, lua_gettop(L)) == "fit_result";
  if (lua_getfield(L, 2, "inputs") == LUA_TTABLE)
    for (lua_pushnil(L); lua_next(L, -2) != 0; lua_pop(L, 1))
      found = found || object_type(L, lua_gettop(L)) == "random_process";
  lua_settop(L, call.count());
  if (!found) return;
  include_embedded(L, "many/options");
  lua_getfield(L, -1, "expand");
  lua_pushvalue(L, 2);
  protected_call(L, 1, 1);
  lua_replace(L, 2);
  lua_settop(L, call.count());
}

int sweep(Call& call) {
  refuse_after_part();
  expand_options(call);
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
  const RemoteExecution elsewhere = read_remote_execution(call, file);
  auto made = std::make_shared<integrate::Sweep>(read_sweep(call, record->space), !file.empty());
  if (file.empty()) {
    CountProgress progress("sweep", "runs", made->runs());
    made->run([&](int done) { progress(done); });
  } else {
    auto store = open ? std::make_shared<store::RunStore>(file)
                      : std::make_shared<store::RunStore>(file, describe_store(*made, *record->space, words));
    if (elsewhere.shards > 0 || elsewhere.slurm != LUA_NOREF) {
      run_remotely(call, *store, elsewhere);
      open = true;
    }
    run_in_store(*made, store, open, retry);
    record->store = std::move(store);
  }
  record->sweep = std::move(made);
  if (!record->sweep->complete() && !open) {
    const int level = level_of_prompt(call.L);
    if (level == 0) throw Interrupted();
    keep_part(call.L, level);
    std::fprintf(stderr, "\ninterrupted; the runs that are done are the result\n");
  }
  return call.push(std::shared_ptr<const SweepRecord>(std::move(record)));
}

/// The properties of a store.
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

}  // namespace

extern const Module sweep_run_module = {
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
         R"(
            x, k = var "x", param "k"
            s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2} }, rtol = 1e-10,
              atol = 1e-10 })
            print(("%.6f %.6f"):format(s:final(x)[1], s:final(x)[2])))",
         "0.367879 0.135335", &sweep_option_rows()},
        {"store_info", store_info, "store_info(file) -> table",
         R"(The contents of a store of runs: runs, done, failed, program, fingerprint, and model and options as Lua text.)",
         R"(
            x, k, file = var "x", param "k", os.tmpname() .. ".db"
            sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2} }, store = file })
            print(store_info(file).done, #load(file)))",
         "2 2"},
    }};

}  // namespace pendula::lua
