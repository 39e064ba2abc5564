// The `functions` module: every named operation of ops.def, on numbers, expressions and matrices.
//
// Numbers yield numbers: sin(0.5) is a Lua float. Integers and number strings are exact: sqrt(2), sin(1)
// remain symbolic with a value (printed √2), which is used where a number is needed; sqrt(4) is 2.
#include <cctype>
#include <cmath>
#include <cstdio>
#include <deque>

#include "base/text.hpp"
#include "lua/bind/expr/expr.hpp"

namespace pendula::lua {
namespace {

std::string argument_names(Op op) {
  switch (op) {
    case Op::atan2:
      return "y, x";
    case Op::ifelse:
      return "condition, p, q";
    case Op::min:
    case Op::max:
    case Op::both:
    case Op::either:
      return "a, b, …";
    default:
      return info(op).arity == 1 ? "x" : "a, b";
  }
}

void check_count(Call& call, int arity) {
  if (call.count() == arity) return;
  throw Error(text("expected ", arity, arity == 1 ? " argument" : " arguments", ", got ", call.count(),
                   call.usage()));
}

/// If all arguments are Lua numbers and one of them is a float, computes the result directly, without
/// graph or allocation.
bool plain_numbers(Call& call, int arity) {
  bool floating = false;
  for (int i = 1; i <= arity; ++i) {
    if (lua_type(call.L, i) != LUA_TNUMBER) return false;
    floating = floating || !lua_isinteger(call.L, i);
  }
  return floating;
}

/// Pushes a condition on numbers as a Lua boolean, so that `if lt(a, b) then` works as expected.
int push_condition(lua_State* L, const Value& value) {
  const Expr* e = std::get_if<Expr>(&value);
  const double* d = std::get_if<double>(&value);
  if (!d && !(e && e->is_constant())) return push(L, value);
  lua_pushboolean(L, d ? *d != 0 : !e->is_zero());
  return 1;
}

template <Op op>
int named(Call& call) {
  const int arity = info(op).arity;
  check_count(call, arity);
  if (plain_numbers(call, arity)) {
    const double value =
        pendula::apply(op, lua_tonumber(call.L, 1), arity > 1 ? lua_tonumber(call.L, 2) : 0, 0);
    if (std::isfinite(value)) return info(op).style == Style::cond ? call.push(value != 0) : call.push(value);
  }
  // A type may define functions of one argument: exp(-2*s) of a linear system is a delay.
  if (arity == 1 && luaL_getmetafield(call.L, 1, text("__", info(op).name).c_str()) != LUA_TNIL) {
    lua_pushvalue(call.L, 1);
    protected_call(call.L, 1, 1);
    return 1;
  }
  std::vector<Value> operands;
  for (int i = 1; i <= arity; ++i)
    operands.push_back(to_value(call.L, i, arity == 1 ? "the argument" : text("argument ", i)));
  const Value value = apply_entrywise(op, operands);
  return info(op).style == Style::cond ? push_condition(call.L, value) : push(call.L, value);
}

template <Op op>
int swapped(Call& call) {  // gt(a, b) is lt(b, a)
  check_count(call, 2);
  lua_insert(call.L, 1);
  return named<op>(call);
}

/// Replaces a list by its entries.
void spread(Call& call) {
  const lua_Integer n = list_size(call.L, 1, "the list");
  if (n == 0) throw Error("the list is empty");
  luaL_checkstack(call.L, static_cast<int>(n) + 20, "the list is too long");
  for (lua_Integer i = 1; i <= n; ++i) lua_rawgeti(call.L, 1, i);
  lua_remove(call.L, 1);
}

/// Folds the arguments, or the entries of the one list or matrix that is given.
template <Op op>
int folded(Call& call) {
  if (call.count() == 0) throw Error("expected at least one argument" + call.usage());
  constexpr bool condition = op == Op::both || op == Op::either;
  std::vector<Value> operands;
  if (condition && call.count() == 1 && lua_istable(call.L, 1)) spread(call);  // a list may contain booleans
  const int count = lua_gettop(call.L);
  for (int i = 1; i <= count; ++i)
    operands.push_back(condition ? to_condition(call.L, i, text("argument ", i))
                                 : to_value(call.L, i, text("argument ", i)));
  if (operands.size() == 1 && is_matrix(operands[0])) {
    const Value all = std::move(operands[0]);
    operands.clear();
    if (const MatX* m = std::get_if<MatX>(&all)) operands.assign(m->data(), m->data() + m->size());
    if (const Mat* m = std::get_if<Mat>(&all)) operands.assign(m->data(), m->data() + m->size());
    if (operands.empty()) throw Error("the list is empty");
  }
  Value result = operands[0];
  for (std::size_t i = 1; i < operands.size(); ++i) result = apply_entrywise(op, {result, operands[i]});
  return condition ? push_condition(call.L, result) : push(call.L, result);
}

int ifelse(Call& call) {
  check_count(call, 3);
  const Value condition = to_condition(call.L, 1, "the condition");
  if (const Expr* e = std::get_if<Expr>(&condition); e && e->is_constant()) {  // p or q itself
    lua_settop(call.L, e->is_zero() ? 3 : 2);
    return 1;
  }
  return push(call.L,
              apply_entrywise(Op::ifelse, {condition, to_value(call.L, 2, "p"), to_value(call.L, 3, "q")}));
}

// ── rows from the table ──

Function function_of(Op op) {
  static constexpr Function table[] = {
#define OP(name, ...) named<Op::name>,
#include "expr/ops.def"
#undef OP
  };
  switch (op) {
    case Op::min:
      return folded<Op::min>;
    case Op::max:
      return folded<Op::max>;
    case Op::both:
      return folded<Op::both>;
    case Op::either:
      return folded<Op::either>;
    case Op::ifelse:
      return ifelse;
    default:
      return table[static_cast<int>(op) - static_cast<int>(first_op)];
  }
}

/// The Lua name. `and` and `or` are reserved words of Lua, so both and either are called all and any.
std::string name_of(Op op) { return op == Op::both ? "all" : op == Op::either ? "any" : info(op).name; }

std::string number(double value) {
  const std::string digits = shortest(value);
  return digits.find_first_of(".e") == std::string::npos ? digits + ".0" : digits;
}

/// The help text of ops.def as a sentence; a text that begins with the call itself is kept.
std::string sentence(std::string words) {
  if (words.find('(') > words.find(' ')) words[0] = static_cast<char>(std::toupper(words[0]));
  return words;
}

std::vector<Row> function_rows() {
  static std::deque<std::string> texts;  // rows store pointers to these
  const auto keep = [](std::string s) { return texts.emplace_back(std::move(s)).c_str(); };
  std::vector<Row> all;
  const auto add = [&](const std::string& name, Function f, const std::string& arguments,
                       const std::string& help, const std::string& example, const std::string& gives) {
    const std::string sig = text(name, "(", arguments, ")");
    all.push_back({keep(name), f, keep(sig), keep(help), keep(example), keep(gives)});
  };
  for (Op op = first_op; op < end_op; op = next(op)) {
    const OpInfo& row = info(op);
    if (row.style == Style::infix) continue;
    const std::string name = name_of(op);
    std::string example = name + "(" + number(row.hi), gives;
    if (row.arity > 1) example += ", " + number(row.lo);
    if (row.arity > 2) example = name + "(lt(1, 2), 1.0, 0.0";
    const double value = row.arity > 2 ? 1 : pendula::apply(op, row.hi, row.lo, 0);
    if (row.style == Style::cond) {
      example = op == Op::lt || op == Op::le ? example + ")" : name + "(lt(1, 2), lt(2, 1))";
      gives = (op == Op::either || (op != Op::both && value != 0)) ? "true" : "false";
    } else {
      char digits[40];
      std::snprintf(digits, sizeof digits, "%.6f", value);
      example = "string.format(\"%.6f\", " + example + "))";
      gives = digits;
    }
    add(name, function_of(op), argument_names(op), sentence(row.help) + "; of matrices entry by entry.",
        example, gives);
  }
  add("gt", swapped<Op::lt>, "a, b", "Condition a > b; of matrices entry by entry.", "gt(1, 2)", "false");
  add("ge", swapped<Op::le>, "a, b", "Condition a ≥ b; of matrices entry by entry.", "ge(2, 2)", "true");
  return all;
}

}  // namespace

extern const Module functions_module = {"functions", "Functions on numbers, expressions and matrices",
                                        function_rows()};

}  // namespace pendula::lua
