#include "lua/bind/expr/expr_subs.hpp"

#include <map>

#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {
namespace {

// ── symbols ──

/// Adds replacements for the derivatives of replaced symbols: {[x] = sin(t)} makes x′ cos t. A derivative
/// that is a key itself keeps its own replacement.
void add_derivatives(std::span<const Expr> outputs, Substitution& replacements) {
  std::map<std::uint32_t, std::map<int, Expr>> by_base;  // base leaf -> order -> value
  for (const auto& [key, value] : replacements)
    if (key.is_symbol() && (symbol_of(key).kind == Kind::variable || symbol_of(key).kind == Kind::input))
      by_base[symbol_of(key).base.id()][symbol_of(key).order] = value;
  for (Expr leaf : leaves(outputs)) {
    const auto known = by_base.find(symbol_of(leaf).base.id());
    if (known == by_base.end() || symbol_of(leaf).kind == Kind::time) continue;
    const int order = symbol_of(leaf).order;
    auto it = known->second.upper_bound(order);
    if (it == known->second.begin()) continue;
    --it;
    if (it->first < order) replacements.emplace(leaf, total_derivative(it->second, order - it->first));
  }
}

void add_replacement(Call& call, std::span<const Expr> known, int key, int value,
                     Substitution& replacements) {
  const bool named = lua_type(call.L, key) == LUA_TSTRING;
  std::vector<Expr> from;
  if (named) {
    from = to_leaves(call.L, key, "the table", known);
  } else {
    if (lua_type(call.L, key) != LUA_TUSERDATA)
      throw Error(text("a key of the table must be a symbol, an expression, a column or a name, not ",
                       describe(call.L, key)));
    const MatX m = to_matrix(call.L, key, "a key of the table");
    from.assign(m.data(), m.data() + m.size());
  }
  if (from.empty()) throw Error("a key of the table has no entries to replace");
  const MatX to = to_matrix(call.L, value, "a value of the table");
  if (to.size() != static_cast<Eigen::Index>(from.size()))
    throw Error(text("'", named ? lua_tostring(call.L, key) : to_text(from[0]), "' stands for ", from.size(),
                     from.size() == 1 ? " entry" : " entries", ", but its value has ", to.size()));
  for (std::size_t i = 0; i < from.size(); ++i) {
    const auto [it, made] = replacements.emplace(from[i], to.data()[i]);
    if (!made) throw Error(text("the table gives '", to_text(from[i]), "' twice"));
  }
}

// ── unspecified functions ──

/// An unspecified function g and the Lua function that defines it.
struct Definition {
  UnspecifiedFunction function;
  int body;  ///< stack index
};

/// The outputs of the Lua function for formal arguments `slots`.
VecX body_of(Call& call, const Definition& definition, const std::vector<int>& groups,
             std::span<const Expr> slots) {
  lua_State* L = call.L;
  luaL_checkstack(L, static_cast<int>(groups.size()) + 20, "too many arguments");
  lua_pushvalue(L, definition.body);
  std::size_t at = 0;
  for (int size : groups) {
    const auto argument = slots.subspan(at, static_cast<std::size_t>(size));
    if (size == 1)
      push_expr(L, argument[0]);
    else
      push_matrix(L, MatX(column(argument)));
    at += static_cast<std::size_t>(size);
  }
  protected_call(L, static_cast<int>(groups.size()), 1);
  const std::string what = text("what the function for '", definition.function.name, "' returned");
  VecX outputs = to_column(L, lua_gettop(L), what);
  if (outputs.size() != definition.function.outputs)
    throw Error(text(what, " has ", outputs.size(), " entries, but it has ", definition.function.outputs,
                     " outputs"));
  lua_pop(L, 1);
  return outputs;
}

/// The expression that a call (or a partial derivative of it) becomes.
Expr defined_call(Call& call, const Definition& definition, int output, const FunctionCall& application) {
  std::vector<Expr> slots;
  for (std::size_t i = 0; i < application.arguments.size(); ++i)
    slots.push_back(symbol(Kind::slot, text("argument", i + 1)));
  Expr e = body_of(call, definition, application.groups, slots)[output];
  Substitution arguments;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    for (int k = 0; k < application.partial[i]; ++k) e = partial(e, slots[i]);
    arguments.emplace(slots[i], application.arguments[i]);
  }
  return substitute(e, arguments);
}

MatX with_definitions(Call& call, const MatX& m, const std::vector<Definition>& definitions) {
  Substitution replacements;
  for (Expr node : topological(entries(m))) {
    if (node.op() != Op::call) continue;
    FunctionCall application = call_of(node);
    for (const Definition& definition : definitions)
      for (int k = 0; k < definition.function.outputs; ++k)
        if (application.name == output_name(definition.function, k)) {
          // calls inside the arguments first
          application.arguments = substitute(application.arguments, replacements);
          replacements[node] = defined_call(call, definition, k, application);
        }
  }
  const auto replaced = substitute(entries(m), replacements);
  return Eigen::Map<const MatX>(replaced.data(), m.rows(), m.cols());
}

}  // namespace

int push_substituted(Call& call) {
  call.table(2, "table");
  const auto replace = [&](const MatX& original) {
    const int top = lua_gettop(call.L);
    std::vector<Definition> definitions;
    lua_pushnil(call.L);
    while (lua_next(call.L, 2) != 0) {
      const int value = lua_gettop(call.L);
      const auto* held = object_at(call.L, value - 1, TypeName<UnspecifiedFunction>::value);
      if (held && *held) {
        if (!lua_isfunction(call.L, value))
          throw Error(text("the value of a func must be a Lua function of its arguments, not ",
                           describe(call.L, value)));
        definitions.push_back({*static_cast<const UnspecifiedFunction*>(held->get()), value});
        luaL_checkstack(call.L, 8, nullptr);
        lua_pushvalue(call.L, value - 1);  // the body stays on the stack; the key goes on top
        continue;
      }
      lua_settop(call.L, value - 1);
    }
    const MatX m = definitions.empty() ? original : with_definitions(call, original, definitions);
    lua_settop(call.L, top);
    const auto known = leaves(entries(m));
    Substitution replacements;
    lua_pushnil(call.L);
    while (lua_next(call.L, 2) != 0) {
      const int value = lua_gettop(call.L);
      if (!object_at(call.L, value - 1, TypeName<UnspecifiedFunction>::value))
        add_replacement(call, known, value - 1, value, replacements);
      lua_settop(call.L, value - 1);
    }
    add_derivatives(entries(m), replacements);
    const auto replaced = substitute(entries(m), replacements);
    return MatX(Eigen::Map<const MatX>(replaced.data(), m.rows(), m.cols()));
  };
  if (!call.is<Equation>(1)) return each(call, replace);
  // both sides together, since a name may occur in one of them only
  Equation equation = call.object<Equation>(1, "equation");
  MatX &left = equation.lhs, &right = equation.rhs;
  MatX both(left.size() + right.size(), 1);
  both << left.reshaped(), right.reshaped();
  const MatX replaced = replace(both);
  left.reshaped() = replaced.topRows(left.size());
  right.reshaped() = replaced.bottomRows(right.size());
  return push_equation(call.L, std::move(equation));
}

}  // namespace pendula::lua
