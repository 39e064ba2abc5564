#include "lua/bind/dae/transitions.hpp"

#include <algorithm>

#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

std::vector<std::pair<Expr, Expr>> read_reset(lua_State* L, int index, std::span<const Expr> known,
                                              const std::string& what) {
  std::vector<std::pair<Expr, Expr>> result;
  if (!lua_istable(L, index)) throw Error(text(what, " must be a table such as { [v] = -0.9*v }"));
  each_symbol_entry(L, index, what, known, [&](const SymbolEntry& entry) {
    const MatX value = to_matrix(L, entry.value, what + "." + entry.key());
    if (value.size() != static_cast<Eigen::Index>(entry.leaves.size()))
      throw Error(text(what, ": '", entry.key(), "' has ", entry.leaves.size(), " components, its value has ",
                       value.size()));
    for (std::size_t i = 0; i < entry.leaves.size(); ++i)
      result.emplace_back(entry.leaves[i], value.data()[i]);
  });
  return result;
}

static dae::Direction read_direction(lua_State* L, int index, const std::string& what) {
  using dae::Direction;
  if (lua_isnil(L, index)) return Direction::both;
  if (lua_type(L, index) == LUA_TSTRING) {
    const std::string word = lua_tostring(L, index);
    if (word == "falling" || word == "down") return Direction::falling;
    if (word == "rising" || word == "up") return Direction::rising;
    if (word == "both") return Direction::both;
  } else if (lua_isnumber(L, index)) {
    const double d = lua_tonumber(L, index);
    for (const Direction known : {Direction::falling_or_negative, Direction::falling, Direction::both,
                                  Direction::rising, Direction::rising_or_positive})
      if (d == static_cast<int>(known)) return known;
  }
  throw Error(text(
      what,
      ".direction must be -1 (falling), 1 (rising) or 0 (both); ±2: also where it is beyond at a start"));
}

static void check_event_keys(lua_State* L, int table, const std::string& what) {
  static const std::vector<std::string> known = {"when", "direction", "action", "reset", "call", "name"};
  lua_pushnil(L);
  while (lua_next(L, table) != 0) {
    lua_pop(L, 1);
    const std::string key = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "[…]";
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw Error(text(what, ": unknown field '", key, "'.", did_you_mean(key, known),
                       " (fields: ", join(known, ", "), ")"));
  }
}

static Expr sign_of(Expr condition);

/// The sign of a condition inside any or all. Throws Error for an expression, which has roots but is neither
/// true nor false.
static Expr sign_of_part(Expr part, const char* function) {
  const bool holds_or_not = part.is_constant() || part.op() == Op::lt || part.op() == Op::le ||
                            part.op() == Op::both || part.op() == Op::either;
  if (!holds_or_not)
    throw Error(text(to_text(part), " in ", function,
                     " is no condition: write lt(a, b), gt(a, b) or the like; ",
                     "events at roots of several expressions are several events"));
  return sign_of(part);
}

/// An expression that is negative where the condition holds and has a root where it begins or ends; other
/// expressions are returned unchanged.
static Expr sign_of(Expr condition) {
  check_stack();
  if (condition.is_symbol() || condition.is_constant()) return condition;
  switch (condition.op()) {
    case Op::lt:
    case Op::le:
      return condition.operand(0) - condition.operand(1);
    case Op::both:
      return make(Op::max, sign_of_part(condition.operand(0), "all"),
                  sign_of_part(condition.operand(1), "all"));
    case Op::either:
      return make(Op::min, sign_of_part(condition.operand(0), "any"),
                  sign_of_part(condition.operand(1), "any"));
    default:
      return condition;
  }
}

/// when = y, a condition such as lt(y, 0), any(…) or all(…) (its change), or an equation y ~ 0.
static Expr read_when(lua_State* L, int index, const std::string& what) {
  if (lua_isnil(L, index)) throw Error(text(what, " needs when: an expression whose roots are the events"));
  if (const auto* held = object_at(L, index, TypeName<Equation>::value)) {
    const auto& equation = *static_cast<const Equation*>(held->get());
    if (equation.lhs.size() == 1) return equation.lhs(0, 0) - equation.rhs(0, 0);
  }
  return sign_of(to_expr(L, index, what + ".when"));
}

dae::Transition read_transition(lua_State* L, int table, std::span<const Expr> known,
                                const std::string& what) {
  if (!lua_istable(L, table))
    throw Error(text(what, " must be a table such as { when = y, direction = -1, action = \"stop\" }"));
  check_event_keys(L, table, what);
  dae::Transition event;
  const auto field = [&](const char* key) {
    lua_pushstring(L, key);
    lua_rawget(L, table);
    return lua_gettop(L);
  };
  const int top = lua_gettop(L);
  event.when = read_when(L, field("when"), what);
  if (event.when.is_constant())
    throw Error(text(what, ".when = ", to_text(event.when),
                     " is constant: give an expression whose roots are the events"));
  event.direction = read_direction(L, field("direction"), what);
  const int action = field("action");
  if (!lua_isnil(L, action)) {
    if (lua_type(L, action) != LUA_TSTRING || std::string(lua_tostring(L, action)) != "stop")
      throw Error(text(
          what, R"(.action can be "stop"; otherwise reset = { [v] = … } or call = function(sol) … end)"));
    event.stop = true;
  }
  if (const int reset = field("reset"); !lua_isnil(L, reset))
    event.reset = read_reset(L, reset, known, what + ".reset");
  lua_settop(L, top);
  return event;
}

}  // namespace pendula::lua
