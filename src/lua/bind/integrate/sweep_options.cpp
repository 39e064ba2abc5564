#include "lua/bind/integrate/sweep_options.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/integrate/integrate_options.hpp"
#include "lua/bind/integrate/sweep_axes.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

namespace {

/// The options of sweep in addition to those of integrate.
const OptionTable& own_rows() {
  static const OptionTable rows = {
      {"grid", "boolean", "false", "all combinations of the lists in params and start, instead of pairs"},
      {"runs", "integer", "",
       "how many runs are drawn where params or start name distributions, or from = a fit"},
      {"seed", "integer", "0", "of the numbers that are drawn; those of a run depend on seed and run only"},
      {"design", "string", "\"monte carlo\"", "how runs fill the distributions",
       "monte carlo|latin hypercube|sobol|halton|grid|star|saltelli|morris"},
      {"scramble", "string", "\"owen\"", "sobol and halton: how sequences are scrambled",
       "owen|digital|none"},
      {"levels", "integer", "", "grid, star, morris: values of each quantity"},
      {"workers", "integer", "", "worker processes; 1: none. Without it one for each processor"},
      {"limit", "number", "", "seconds that one run may take; a longer one is a failure"},
      {"store", "string", "", "file that takes the results, \"runs.db\"; stored runs are not computed again"},
      {"retry", "boolean", "false", "store: runs that failed are made again"},
      {"shards", "integer", "",
       "store: the runs are left to others, divided into this many shards (pendula shard)"},
      {"on", "slurm", "",
       "store: the runs are made by a cluster, slurm{ partition = …, tasks = 64, time = \"2h\" }"},
      {"open", "boolean", "false", "store: only the stored runs; none is computed"},
      {"lanes", "integer", "", "runs that advance together on SIMD lanes: 1, 4 or 8"},
  };
  return rows;
}

}  // namespace

const OptionTable& sweep_option_rows() {
  static const OptionTable rows = joined(integrate_option_rows(), own_rows());
  return rows;
}
namespace {

using integrate::SweepSet;

Call& with_table(Call& call) {
  call.table(2, "{ start =, to =, params = { m = {…} } }");
  return call;
}

/// Reads the options of sweep, and provides those of integrate with the values of one run in place
/// of the lists.
class Reader {
 public:
  explicit Reader(Call& call)
      : call_(call),
        L_(call.L),
        model_(call.shared<dae::Model>(1, "model")),
        given_(with_table(call), model_) {
    const Options all = call.options(2);
    grid_ = all.boolean("grid", false);
    read_design(all);
    const long workers = all.integer("workers", 0);
    if (all.has("workers") && (workers < 1 || workers > 1024))
      throw Error(text("workers = ", workers, "; the number of processes must lie between 1 and 1024"));
    request_.workers = static_cast<int>(workers);
    request_.limit = all.number("limit", 0);
    if (all.has("limit") && !(request_.limit > 0))
      throw Error(
          text("limit = ", shortest(request_.limit), "; the seconds that one run may take must be positive"));
    const long lanes = all.integer("lanes", 0);
    if (all.has("lanes") && lanes != 1 && lanes != 4 && lanes != 8)
      throw Error(text("lanes = ", lanes, "; it must be 1 (one run after another), 4 or 8"));
    request_.lanes = static_cast<int>(lanes);
    if (!all.has("start") && model_->start_values.empty())
      throw Error(
          "needs a start: start = sys:init{ fix = { … } }, a table start = { x = 1 }, or a list of these");
  }

  integrate::SweepRequest read() {
    given_.read_params();
    given_.read_start();
    std::vector<random::Column> columns;
    for (const SweepAxis& axis : given_.axes()) columns.push_back(axis.column);
    space_ = std::make_shared<const random::SampleSpace>(std::move(columns), grid_, design_);
    request_.model = model_;
    read_base();
    describe_sets();
    return std::move(request_);
  }
  std::shared_ptr<const random::SampleSpace> space() const { return space_; }

 private:
  void read_design(const Options& all) {
    const bool given =
        all.has("design") || all.has("runs") || all.has("seed") || all.has("scramble") || all.has("levels");
    if (!given) return;
    random::DesignRequest r;
    r.kind = random::design_kind(all.string("design", "monte carlo"));
    r.runs = all.integer("runs", 0);
    if (all.has("runs") && r.runs < 1)
      throw Error(text("runs = ", r.runs, "; at least one run must be made"));
    r.seed = static_cast<std::uint64_t>(all.integer("seed", 0));
    r.levels = static_cast<int>(std::clamp(all.integer("levels", 0), -1L, 1'000'000L));
    const std::string scramble = all.string("scramble", "owen");
    const std::vector<std::string> kinds = {"none", "digital", "owen"};
    const auto at = std::find(kinds.begin(), kinds.end(), scramble);
    if (at == kinds.end())
      throw Error(text("scramble = '", scramble, "'; known are \"owen\", \"digital\" and \"none\".",
                       did_you_mean(scramble, kinds)));
    r.scramble = static_cast<random::Scramble>(at - kinds.begin());
    design_ = r;
  }

  void copy_of(int reference) {
    lua_newtable(L_);
    lua_rawgeti(L_, LUA_REGISTRYINDEX, reference);
    for (lua_pushnil(L_); lua_next(L_, -2) != 0;) {
      lua_pushvalue(L_, -2);
      lua_insert(L_, -2);
      lua_rawset(L_, -5);
    }
    lua_pop(L_, 1);
  }

  /// Replaces argument 2 by the options of integrate for one run.
  void offer(long run) {
    lua_settop(L_, call_.count());
    copy_of(given_.options());
    const int options = lua_gettop(L_);
    for (const OptionRow& row : own_rows()) {
      lua_pushnil(L_);
      lua_setfield(L_, options, row.name);
    }
    copy_of(given_.fixed_params());
    const int params = lua_gettop(L_);
    copy_of(given_.fixed_start());
    const int start = lua_gettop(L_);
    for (std::size_t a = 0; a < given_.axes().size(); ++a) {
      if (given_.axes()[a].starts) continue;
      push_expr(L_, given_.axes()[a].leaf);
      lua_pushnumber(L_, space_->value(a, run));
      lua_rawset(L_, given_.axes()[a].parameter ? params : start);
    }
    if (given_.has_keyed_start()) {
      lua_pushvalue(L_, start);
      lua_setfield(L_, options, "start");
    }
    for (std::size_t a = 0; a < given_.axes().size(); ++a)
      if (given_.axes()[a].starts) {
        lua_rawgeti(L_, given_.original("start"), static_cast<lua_Integer>(space_->place(a, run)) + 1);
        lua_setfield(L_, options, "start");
      }
    lua_pushvalue(L_, params);
    lua_setfield(L_, options, "params");
    lua_pushvalue(L_, options);
    lua_replace(L_, 2);
    lua_settop(L_, call_.count());
  }

  /// Reads the options common to all runs, with the first run whose start can be solved.
  void read_base() {
    std::exception_ptr first;
    const long stride = std::max(1L, space_->runs() / 20);
    for (long run = 0; run < space_->runs(); run += stride) {
      offer(run);
      const Options options = call_.options(2);
      try {
        request_.simulation = read_simulation(call_, options, model_);
        // form "array" may need other rows at this start: then all runs begin with those
        request_.model = model_ = request_.simulation.start->model;
        return;
      } catch (const UserFacing&) {
        if (!first) first = std::current_exception();
        lua_settop(L_, call_.count());
      }
    }
    std::rethrow_exception(first);
  }

  void describe_sets() {
    auto starts = std::make_shared<std::vector<dae::ConsistentStatePtr>>();
    for (const SweepAxis& axis : given_.axes())
      if (axis.starts) *starts = read_starts(axis.column.list.size());
    request_.runs = static_cast<int>(space_->runs());
    request_.own_starts = !starts->empty();
    request_.varied = [space = space_](int run) {
      std::vector<double> values;
      for (std::size_t c = 0; c < space->columns().size(); ++c) values.push_back(space->value(c, run));
      return values;
    };
    request_.set = [space = space_, axes = given_.axes(), starts](int run) {
      SweepSet set;
      for (std::size_t a = 0; a < axes.size(); ++a) {
        if (axes[a].starts)
          set.at = (*starts)[space->place(a, run)];
        else
          (axes[a].parameter ? set.parameters : set.start).emplace_back(axes[a].leaf, space->value(a, run));
      }
      return set;
    };
  }

  /// The conditions of each start in a list; solved when the run begins.
  std::vector<dae::ConsistentStatePtr> read_starts(std::size_t count) {
    std::vector<dae::ConsistentStatePtr> starts;
    for (std::size_t i = 0; i < count; ++i) {
      lua_rawgeti(L_, given_.original("start"), static_cast<lua_Integer>(i) + 1);
      const int item = lua_gettop(L_);
      const std::string what = text("start[", i + 1, "]");
      if (const auto* held = object_at(L_, item, TypeName<dae::ConsistentState>::value)) {
        const auto at = std::static_pointer_cast<const dae::ConsistentState>(*held);
        if (at->model != model_)
          throw Error(
              text(what, " was made with another model; make it with this model's init, or give a table"));
        starts.push_back(at);
      } else {
        auto at = std::make_shared<dae::ConsistentState>();
        at->model = model_;
        at->request = request_.simulation.start->request;
        at->request.fix = read_leaf_values(L_, item, what, *model_);
        starts.push_back(std::move(at));
      }
      lua_settop(L_, call_.count());
    }
    return starts;
  }

  Call& call_;
  lua_State* L_;
  dae::ModelPtr model_;
  AxisReader given_;
  integrate::SweepRequest request_;
  std::optional<random::DesignRequest> design_;
  std::shared_ptr<const random::SampleSpace> space_;
  bool grid_ = false;
};

}  // namespace

integrate::SweepRequest read_sweep(Call& call, std::shared_ptr<const random::SampleSpace>& space) {
  Reader reader(call);
  integrate::SweepRequest request = reader.read();
  space = reader.space();
  return request;
}

}  // namespace pendula::lua
