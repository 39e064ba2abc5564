#include "lua/bind/integrate/sweep_options.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/integrate/integrate_options.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {
namespace {

using integrate::SweepSet;
constexpr long most_runs = 10'000'000;

/// An axis while it is read: a leaf with its values, or a list of starts.
struct Axis {
  std::string name;
  Expr leaf;
  bool parameter = false, starts = false;
  std::vector<double> values;
};

/// The axes of a sweep and which values of them every run has: in pairs, or all
/// combinations, the last axis fastest.
class Layout {
 public:
  void add(Axis axis) { axes_.push_back(std::move(axis)); }
  /// The order of a Lua table's keys is nobody's, that of declarations may lie in another file.
  void order_by_name(std::size_t first) {
    std::sort(axes_.begin() + static_cast<std::ptrdiff_t>(first), axes_.end(),
              [](const Axis& a, const Axis& b) { return a.name < b.name; });
  }
  /// Counts the runs. Throws Error where nothing varies, lists do not fit together or are too many.
  void close(bool grid);

  const std::vector<Axis>& axes() const { return axes_; }
  long runs() const { return runs_; }
  /// The place in the list of an axis that a run takes.
  std::size_t index(std::size_t axis, long run) const;
  std::vector<SweepAxis> values() const;

 private:
  void combine();
  void pair();
  std::vector<Axis> axes_;
  bool grid_ = false;
  long runs_ = 1;
};

void Layout::close(bool grid) {
  grid_ = grid;
  if (axes_.empty())
    throw Error(
        "nothing varies: give lists, for example params = { m = linspace(1, 2, 10) } or start = { x = {1, 2, 3} }");
  grid ? combine() : pair();
}

void Layout::combine() {
  for (const Axis& axis : axes_) {
    runs_ *= static_cast<long>(axis.values.size());
    if (runs_ > most_runs) throw Error("more than 10 000 000 combinations; give shorter lists");
  }
}

void Layout::pair() {
  const Axis* longest = &axes_[0];
  for (const Axis& axis : axes_)
    if (axis.values.size() > longest->values.size()) longest = &axis;
  for (const Axis& axis : axes_)
    if (axis.values.size() != 1 && axis.values.size() != longest->values.size())
      throw Error(text("the lists are paired, but ", axis.name, " has ", axis.values.size(), " values and ",
                       longest->name, " has ", longest->values.size(),
                       "; give lists of one length, or grid = true for all combinations"));
  runs_ = static_cast<long>(longest->values.size());
  if (runs_ > most_runs) throw Error("more than 10 000 000 runs; give shorter lists");
}

std::size_t Layout::index(std::size_t axis, long run) const {
  const auto size = [&](std::size_t a) { return static_cast<long>(axes_[a].values.size()); };
  if (!grid_) return size(axis) == 1 ? 0 : static_cast<std::size_t>(run);
  for (std::size_t a = axes_.size() - 1; a > axis; --a) run /= size(a);
  return static_cast<std::size_t>(run % size(axis));
}

std::vector<SweepAxis> Layout::values() const {
  std::vector<SweepAxis> result;
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    SweepAxis axis{axes_[a].name, {}};
    for (long run = 0; run < runs_; ++run)
      axis.values.push_back(axes_[a].starts ? static_cast<double>(index(a, run) + 1)
                                            : axes_[a].values[index(a, run)]);
    result.push_back(std::move(axis));
  }
  return result;
}

/// Reads the options of sweep and offers those of integrate, with the values
/// of one run in the place of the lists.
class Reader {
 public:
  explicit Reader(Call& call) : call_(call), L_(call.L), model_(call.shared<dae::Model>(1, "model")) {
    call.table(2, "{ start =, to =, params = { m = {…} } }");
    const Options all = call.options(2, {PENDULA_INTEGRATE_OPTIONS, "grid", "workers", "lanes"});
    grid_ = all.boolean("grid", false);
    const long workers = all.integer("workers", 0);
    if (all.has("workers") && (workers < 1 || workers > 1024))
      throw Error(text("workers = ", workers, "; the number of processes must lie between 1 and 1024"));
    request_.workers = static_cast<int>(workers);
    const long lanes = all.integer("lanes", 0);
    if (all.has("lanes") && lanes != 1 && lanes != 4 && lanes != 8)
      throw Error(text("lanes = ", lanes, "; it must be 1 (one run after another), 4 or 8"));
    request_.lanes = static_cast<int>(lanes);
    if (!all.has("start"))
      throw Error(
          "needs a start: start = sys:init{ fix = { … } }, a table start = { x = 1 }, or a list of these");
    lua_pushvalue(L_, 2);
    original_ = luaL_ref(L_, LUA_REGISTRYINDEX);
    lua_newtable(L_), fixed_params_ = luaL_ref(L_, LUA_REGISTRYINDEX);
    lua_newtable(L_), fixed_start_ = luaL_ref(L_, LUA_REGISTRYINDEX);
  }
  ~Reader() {
    for (int reference : {original_, fixed_params_, fixed_start_})
      luaL_unref(L_, LUA_REGISTRYINDEX, reference);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  integrate::SweepRequest read() {
    read_params();
    read_start_axes();
    layout_.close(grid_);
    request_.model = model_;
    read_base();
    fill_sets();
    return std::move(request_);
  }
  const Layout& layout() const { return layout_; }

 private:
  int original(const char* key) {
    lua_rawgeti(L_, LUA_REGISTRYINDEX, original_);
    lua_getfield(L_, -1, key);
    lua_remove(L_, -2);
    return lua_gettop(L_);
  }

  /// A list of more than one number for one leaf is swept; what is not goes into `fixed`.
  void sort(const SymbolEntry& entry, const std::string& what, bool parameter, int fixed) {
    const bool list = lua_istable(L_, entry.value) || object_at(L_, entry.value, TypeName<Matrix>::value);
    if (list && entry.leaves.size() == 1) {
      const Mat m = to_numeric_matrix(L_, entry.value, what + "." + entry.key);
      if (m.size() == 0) throw Error(text(what, ".", entry.key, " is an empty list"));
      if (m.rows() > 1 && m.cols() > 1)
        throw Error(text(what, ".", entry.key, " must be a list of numbers, not a ", m.rows(), "×", m.cols(),
                         " matrix"));
      for (double v : m.reshaped())
        if (!std::isfinite(v)) throw Error(text(what, ".", entry.key, " contains ", shortest(v)));
      layout_.add({leaf_name(entry.leaves[0]), entry.leaves[0], parameter, false,
                   std::vector<double>(m.data(), m.data() + m.size())});
      return;
    }
    const MatX value = to_matrix(L_, entry.value, what + "." + entry.key);
    if (value.size() != static_cast<Eigen::Index>(entry.leaves.size()))
      throw Error(text(what, ": '", entry.key, "' has ", entry.leaves.size(), " components, its value has ",
                       value.size(), "; sweep over single components, { ", leaf_name(entry.leaves[0]),
                       " = {…} }"));
    lua_rawgeti(L_, LUA_REGISTRYINDEX, fixed);
    for (std::size_t i = 0; i < entry.leaves.size(); ++i) {
      push_expr(L_, entry.leaves[i]);
      push_expr(L_, value.data()[i]);
      lua_rawset(L_, -3);
    }
    lua_pop(L_, 1);
  }

  void read_params() {
    const int params = original("params");
    if (!lua_isnil(L_, params))
      each_symbol_entry(L_, params, "params", model_->parameters,
                        [&](const SymbolEntry& entry) { sort(entry, "params", true, fixed_params_); });
    layout_.order_by_name(0);
    lua_settop(L_, call_.count());
  }

  void read_start_axes() {
    const int start = original("start");
    if (lua_istable(L_, start)) {
      if (lua_rawlen(L_, start) > 0) {
        const lua_Integer n = list_size(L_, start, "start");
        for (lua_Integer i = 1; i <= n; ++i) {
          lua_rawgeti(L_, start, i);
          if (!lua_istable(L_, -1) && !object_at(L_, -1, TypeName<dae::ConsistentState>::value))
            throw Error(text("start[", i, "] must be a result of init or a table { x = 1, … }, got ",
                             describe(L_, -1)));
          lua_pop(L_, 1);
        }
        layout_.add({"start", {}, false, true, std::vector<double>(static_cast<std::size_t>(n))});
      } else {
        keyed_start_ = true;
        const std::size_t first = layout_.axes().size();
        each_symbol_entry(L_, start, "start", known_leaves(*model_),
                          [&](const SymbolEntry& entry) { sort(entry, "start", false, fixed_start_); });
        layout_.order_by_name(first);
      }
    }
    lua_settop(L_, call_.count());
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

  /// Argument 2 becomes the options of integrate for one run.
  void offer(long run) {
    lua_settop(L_, call_.count());
    copy_of(original_);
    const int options = lua_gettop(L_);
    for (const char* key : {"grid", "workers", "lanes"}) {
      lua_pushnil(L_);
      lua_setfield(L_, options, key);
    }
    copy_of(fixed_params_);
    const int params = lua_gettop(L_);
    copy_of(fixed_start_);
    const int start = lua_gettop(L_);
    for (std::size_t a = 0; a < layout_.axes().size(); ++a) {
      if (layout_.axes()[a].starts) continue;
      push_expr(L_, layout_.axes()[a].leaf);
      lua_pushnumber(L_, layout_.axes()[a].values[layout_.index(a, run)]);
      lua_rawset(L_, layout_.axes()[a].parameter ? params : start);
    }
    if (keyed_start_) {
      lua_pushvalue(L_, start);
      lua_setfield(L_, options, "start");
    }
    for (std::size_t a = 0; a < layout_.axes().size(); ++a)
      if (layout_.axes()[a].starts) {
        lua_rawgeti(L_, original("start"), static_cast<lua_Integer>(layout_.index(a, run)) + 1);
        lua_setfield(L_, options, "start");
      }
    lua_pushvalue(L_, params);
    lua_setfield(L_, options, "params");
    lua_pushvalue(L_, options);
    lua_replace(L_, 2);
    lua_settop(L_, call_.count());
  }

  /// The options common to all runs are read with the first run whose start can be solved.
  void read_base() {
    std::exception_ptr first;
    const long stride = std::max(1L, layout_.runs() / 20);
    for (long run = 0; run < layout_.runs(); run += stride) {
      offer(run);
      const Options options = call_.options(2, {PENDULA_INTEGRATE_OPTIONS});
      try {
        request_.simulation = read_simulation(call_, options, model_);
        return;
      } catch (const UserFacing&) {
        if (!first) first = std::current_exception();
        lua_settop(L_, call_.count());
      }
    }
    std::rethrow_exception(first);
  }

  void fill_sets() {
    std::vector<dae::ConsistentStatePtr> starts;
    for (const Axis& axis : layout_.axes())
      if (axis.starts) starts = read_starts(axis);
    for (long run = 0; run < layout_.runs(); ++run) {
      SweepSet set;
      for (std::size_t a = 0; a < layout_.axes().size(); ++a) {
        const std::size_t i = layout_.index(a, run);
        if (layout_.axes()[a].starts)
          set.at = starts[i];
        else
          (layout_.axes()[a].parameter ? set.parameters : set.start)
              .emplace_back(layout_.axes()[a].leaf, layout_.axes()[a].values[i]);
      }
      request_.sets.push_back(std::move(set));
    }
  }

  /// A list of starts: what each of them fixes; solved when its run begins.
  std::vector<dae::ConsistentStatePtr> read_starts(const Axis& axis) {
    std::vector<dae::ConsistentStatePtr> starts;
    for (std::size_t i = 0; i < axis.values.size(); ++i) {
      lua_rawgeti(L_, original("start"), static_cast<lua_Integer>(i) + 1);
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
  integrate::SweepRequest request_;
  Layout layout_;
  bool grid_ = false, keyed_start_ = false;
  int original_, fixed_params_, fixed_start_;
};

}  // namespace

integrate::SweepRequest read_sweep(Call& call, std::vector<SweepAxis>& axes) {
  Reader reader(call);
  integrate::SweepRequest request = reader.read();
  axes = reader.layout().values();
  return request;
}

}  // namespace pendula::lua
