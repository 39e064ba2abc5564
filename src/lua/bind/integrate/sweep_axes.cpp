#include "lua/bind/integrate/sweep_axes.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/integrate/integrate_options.hpp"
#include "lua/bind/random/random.hpp"
#include "lua/core/objects.hpp"
#include "lua/read/inputs.hpp"

namespace pendula::lua {

AxisReader::AxisReader(Call& call, dae::ModelPtr model) : call_(call), L_(call.L), model_(std::move(model)) {
  lua_pushvalue(L_, 2);
  original_ = luaL_ref(L_, LUA_REGISTRYINDEX);
  lua_newtable(L_);
  fixed_params_ = luaL_ref(L_, LUA_REGISTRYINDEX);
  lua_newtable(L_);
  fixed_start_ = luaL_ref(L_, LUA_REGISTRYINDEX);
}

AxisReader::~AxisReader() {
  for (int reference : {original_, fixed_params_, fixed_start_}) luaL_unref(L_, LUA_REGISTRYINDEX, reference);
}

int AxisReader::original(const char* key) {
  lua_rawgeti(L_, LUA_REGISTRYINDEX, original_);
  lua_getfield(L_, -1, key);
  lua_remove(L_, -2);
  return lua_gettop(L_);
}

void AxisReader::note(Expr leaf) {
  if (std::find(given_.begin(), given_.end(), leaf) != given_.end())
    throw Error(text(leaf_name(leaf), " is given twice, by its name and by a fit; leave one of them out"));
  given_.push_back(leaf);
}

void AxisReader::add(Expr leaf, bool parameter, random::Column column) {
  note(leaf);
  column.name = leaf_name(leaf);
  axes_.push_back({std::move(column), leaf, parameter, false});
}
/// Sorts by name: the order of keys of a Lua table is arbitrary, and declarations may lie in another file.
void AxisReader::order_by_name(std::size_t first) {
  std::sort(axes_.begin() + static_cast<std::ptrdiff_t>(first), axes_.end(),
            [](const SweepAxis& a, const SweepAxis& b) { return a.column.name < b.column.name; });
}

/// Takes a distribution for a leaf, or a joint one for as many leaves as it has components; false
/// for anything else.
bool AxisReader::sort_drawn(const SymbolEntry& entry, const std::string& what, bool parameter) {
  random::Column column;
  column.distribution = distribution_at(L_, entry.value);
  if (const auto* held = object_at(L_, entry.value, TypeName<JointComponent>::value)) {
    const auto component = std::static_pointer_cast<const JointComponent>(*held);
    column.joint = component->joint;
    column.component = component->number;
  }
  const auto* joint = object_at(L_, entry.value, TypeName<random::JointNormal>::value);
  if (joint) {
    column.joint = std::static_pointer_cast<const random::JointNormal>(*joint);
    if (column.joint->size() != static_cast<int>(entry.leaves.size()))
      throw Error(text(what, ".", entry.key(), " has ", entry.leaves.size(),
                       " components, its distribution has ", column.joint->size()));
  } else if (!column.drawn()) {
    return false;
  } else if (entry.leaves.size() != 1) {
    throw Error(text(what, ".", entry.key(), " has ", entry.leaves.size(),
                     " components; give each a distribution, or all of them normal({…}, covariance)"));
  }
  for (Expr leaf : entry.leaves) {
    add(leaf, parameter, column);
    ++column.component;
  }
  return true;
}

/// Sorts an entry: a list of several numbers for one leaf is swept, distributions are sampled, anything else
/// goes into `fixed`.
void AxisReader::sort(const SymbolEntry& entry, const std::string& what, bool parameter, int fixed) {
  if (sort_drawn(entry, what, parameter)) return;
  const bool list = lua_istable(L_, entry.value) || object_at(L_, entry.value, TypeName<Matrix>::value);
  if (list && entry.leaves.size() == 1) {
    const Mat m = to_numeric_matrix(L_, entry.value, what + "." + entry.key());
    if (m.size() == 0) throw Error(text(what, ".", entry.key(), " is an empty list"));
    if (m.rows() > 1 && m.cols() > 1)
      throw Error(text(what, ".", entry.key(), " must be a list of numbers, not a ", m.rows(), "×", m.cols(),
                       " matrix"));
    for (double v : m.reshaped())
      if (!std::isfinite(v)) throw Error(text(what, ".", entry.key(), " contains ", shortest(v)));
    random::Column column;
    column.list.assign(m.data(), m.data() + m.size());
    add(entry.leaves[0], parameter, std::move(column));
    return;
  }
  const MatX value = to_matrix(L_, entry.value, what + "." + entry.key());
  if (value.size() != static_cast<Eigen::Index>(entry.leaves.size()))
    throw Error(text(what, ": '", entry.key(), "' has ", entry.leaves.size(), " components, its value has ",
                     value.size(), "; sweep over single components, { ", leaf_name(entry.leaves[0]),
                     " = {…} }"));
  lua_rawgeti(L_, LUA_REGISTRYINDEX, fixed);
  for (std::size_t i = 0; i < entry.leaves.size(); ++i) {
    note(entry.leaves[i]);
    push_expr(L_, entry.leaves[i]);
    push_expr(L_, value.data()[i]);
    lua_rawset(L_, -3);
  }
  lua_pop(L_, 1);
}

/// Adds the parameters of a fit (fields names, theta, cov) with the joint distribution of its covariance.
void AxisReader::add_estimates(int fit) {
  const std::string type = object_type(L_, fit);
  for (const char* field : {"names", "theta", "cov"}) {
    const bool known = !type.empty() && push_member(L_, type.c_str(), field);
    if (!known)
      throw Error(text("params contains ", describe(L_, fit),
                       " without a name; expected names with values, or a result of fit(…)"));
    lua_pushvalue(L_, fit);
    protected_call(L_, 1, 1);
  }
  const int cov = lua_gettop(L_);
  random::Column column;
  column.joint = std::make_shared<const random::JointNormal>(to_numbers(L_, cov - 1, "theta"),
                                                             to_numeric_matrix(L_, cov, "cov"));
  const auto& parameters = model_->parameters;
  std::vector<Expr> known = known_leaves(*model_);
  known.insert(known.end(), parameters.begin(), parameters.end());
  std::vector<Expr> leaves;
  const int names = cov - 2;
  for (lua_Integer i = 1; i <= luaL_len(L_, names); ++i) {
    lua_geti(L_, names, i);
    std::string name = lua_tostring(L_, -1);
    if (const auto at = name.find("(0)"); at != std::string::npos)
      name.erase(at);  // an initial value, "x(0)"
    lua_pushlstring(L_, name.data(), name.size());
    leaves.push_back(to_leaves(L_, lua_gettop(L_), "the fit's names", known).at(0));
    lua_pop(L_, 2);
  }
  if (static_cast<int>(leaves.size()) != column.joint->size())
    throw Error("the fit's names and covariance do not fit together");
  for (Expr leaf : leaves) {
    add(leaf, std::find(parameters.begin(), parameters.end(), leaf) != parameters.end(), column);
    ++column.component;
  }
  lua_settop(L_, fit);
}

/// Moves the entries without names out of params.
int AxisReader::named_params(int params) {
  if (!lua_istable(L_, params)) {
    if (object_type(L_, params).empty()) return params;
    add_estimates(params);
    lua_newtable(L_);
    return lua_gettop(L_);
  }
  const auto count = static_cast<lua_Integer>(lua_rawlen(L_, params));
  if (count == 0) return params;
  lua_newtable(L_);
  const int named = lua_gettop(L_);
  for (lua_pushnil(L_); lua_next(L_, params) != 0;) {
    if (lua_isinteger(L_, -2)) {
      add_estimates(lua_gettop(L_));
      lua_pop(L_, 1);
      continue;
    }
    lua_pushvalue(L_, -2);
    lua_insert(L_, -2);
    lua_rawset(L_, named);
  }
  return named;
}

void AxisReader::read_params() {
  std::vector<Expr> known = model_->parameters;
  const int inputs = original("inputs"), events = original("events");
  for (Expr p : parameters_beside(L_, inputs, events))
    if (std::find(known.begin(), known.end(), p) == known.end()) known.push_back(p);
  int params = original("params");
  if (!lua_isnil(L_, params)) params = named_params(params);
  if (!lua_isnil(L_, params))
    each_known_entry(L_, params, "params", known,
                     [&](const SymbolEntry& entry) { sort(entry, "params", true, fixed_params_); });
  order_by_name(0);
  lua_settop(L_, call_.count());
}

void AxisReader::read_start() {
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
      random::Column column;
      column.name = "start";
      for (lua_Integer i = 1; i <= n; ++i) column.list.push_back(static_cast<double>(i));
      axes_.push_back({std::move(column), {}, false, true});
    } else {
      keyed_start_ = true;
      const std::size_t first = axes_.size();
      each_symbol_entry(L_, start, "start", known_leaves(*model_),
                        [&](const SymbolEntry& entry) { sort(entry, "start", false, fixed_start_); });
      order_by_name(first);
    }
  }
  lua_settop(L_, call_.count());
}

}  // namespace pendula::lua
