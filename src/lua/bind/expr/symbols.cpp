// Symbols of every kind: variables, parameters, inputs, unspecified functions, t and π.
#include <cstring>

#include "base/text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/assumption.hpp"
#include "lua/bind/expr/expr.hpp"
#include "lua/bind/expr/expr_subs.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {
namespace {

void check_free_name(const std::string& name) {
  if (name == "t") throw Error("'t' is the independent variable; it exists already");
  if (name == "pi") throw Error("'pi' is the number π; it exists already");
}

struct Attributes {
  bool given = false;
  std::string unit, label;
  std::optional<bool> positive;
};

const OptionTable symbol_options = {
    {"unit", "string", "", "the unit, as in \"m/s\": on axes, in ledgers, for units = \"check\""},
    {"text", "string", "", "its meaning in a few words, for axes and ledgers"},
    {"positive", "boolean", "", "true: greater than 0, |L| = L and √(L²) = L"},
};

Attributes read_attributes(Call& call, int index) {
  const Options options = call.options(index);
  Attributes given{call.has(index), options.string("unit", ""), options.string("text", ""), {}};
  if (options.has("positive")) given.positive = options.boolean("positive", false);
  return given;
}

void declare_positive(Expr leaf, bool positive) {
  const auto& value = symbol_of(leaf).value;
  if (positive && value && value->is_constant() && constant_value(*value) <= 0)
    throw Error(text("'", symbol_of(leaf).name, "' cannot be positive: its value is ", to_text(*value)));
  assume_positive(leaf, positive);
}

/// Sets the given attributes; a declaration without options keeps those of an earlier one.
void set_attributes(std::span<const Expr> leaves, const Attributes& given) {
  note_declared(leaves);
  if (!given.given) return;
  for (Expr leaf : leaves) {
    if (given.positive) declare_positive(leaf, *given.positive);
    attributes(leaf).unit = given.unit;
    attributes(leaf).label = given.label;
    if (leaves.size() > 1 && !given.label.empty())
      attributes(leaf).label += text(" ", symbol_of(leaf).component);
  }
}

/// Common implementation of var(name [, size] [, options]) and similar functions.
int declare(Call& call, Kind kind) {
  const std::string name = call.string(1, "name");
  check_free_name(name);
  const bool sized = call.has(2) && lua_type(call.L, 2) != LUA_TTABLE;
  const Attributes given = read_attributes(call, sized ? 3 : 2);
  if (!sized) {
    const Expr leaf = newly_declared({symbol(kind, name)})[0];
    set_attributes({&leaf, 1}, given);
    return push_expr(call.L, leaf);
  }
  const long size = call.integer(2, "size");
  constexpr long most = 1'000'000;
  if (size < 1 || size > most)
    throw Error(text("the size of '", name, "' must be between 1 and ", most, ", not ", size));
  const auto leaves = newly_declared(symbol_vector(kind, name, static_cast<int>(size)));
  set_attributes(leaves, given);
  return push_matrix(call.L, MatX(column(leaves)));
}

int declare_words(Call& call, Kind kind) {
  const auto names = split_words(call.string(1, "names"));
  if (names.empty()) throw Error("expected names, as in vars \"x y z\"");
  const Attributes given = read_attributes(call, 2);
  luaL_checkstack(call.L, static_cast<int>(names.size()) + 20, "too many names");
  std::vector<Expr> leaves;
  for (const std::string& name : names) {
    check_free_name(name);
    leaves.push_back(symbol(kind, name));
  }
  for (Expr leaf : newly_declared(leaves)) {
    set_attributes({&leaf, 1}, given);
    push_expr(call.L, leaf);
  }
  return static_cast<int>(names.size());
}

int var(Call& call) { return declare(call, Kind::variable); }
int vars(Call& call) { return declare_words(call, Kind::variable); }
int input(Call& call) { return declare(call, Kind::input); }
int inputs(Call& call) { return declare_words(call, Kind::input); }

/// The constant value of a default: √2 is converted to a decimal here and nowhere else.
Expr default_value(Expr e, const std::string& name) {
  if (e.is_constant()) return e;
  if (const auto value = number_value(e)) return Expr(*value);
  throw Error(text("the value of '", name, "' must be a number, not the expression ", to_text(e)));
}

int params(Call& call);

int param(Call& call) {
  const std::string name = call.string(1, "name");
  if (name.find('=') != std::string::npos) {  // param "L=1"
    if (call.has(2) && !(lua_istable(call.L, 2) && lua_rawlen(call.L, 2) == 0))
      throw Error(text("'", name, "' has its value already; write param \"", name, "\" or param(\"",
                       name.substr(0, name.find_first_of("= ")), "\", value)"));
    return params(call);
  }
  check_free_name(name);
  const bool only_options = lua_istable(call.L, 2) && lua_rawlen(call.L, 2) == 0;
  const Attributes given = read_attributes(call, only_options ? 2 : 3);
  if (only_options || !call.has(2) || is_expression(call.L, 2)) {
    const Expr leaf = newly_declared({symbol(Kind::parameter, name)})[0];
    std::optional<Expr> value;
    if (!only_options && call.has(2)) value = default_value(to_expr(call.L, 2, "value"), name);
    attributes(leaf).value = value;
    set_attributes({&leaf, 1}, given);
    return push_expr(call.L, leaf);
  }
  const VecX values = to_column(call.L, 2, "value");
  const auto leaves = newly_declared(symbol_vector(Kind::parameter, name, static_cast<int>(values.size())));
  for (std::size_t i = 0; i < leaves.size(); ++i)
    attributes(leaves[i]).value = default_value(values[i], name);
  set_attributes(leaves, given);
  return push_matrix(call.L, MatX(column(leaves)));
}

/// Removes blanks around =, so that "m = 1" and "m=1" are single words.
std::string without_blanks_around_equals(const std::string& words) {
  std::string out;
  for (char ch : words) {
    if (ch == '=')
      while (!out.empty() && out.back() == ' ') out.pop_back();
    if (ch == ' ' && !out.empty() && out.back() == '=') continue;
    out += ch;
  }
  return out;
}

int params(Call& call) {
  const auto words = split_words(without_blanks_around_equals(call.string(1, "names")));
  if (words.empty()) throw Error("expected names, as in params \"m=1 g=9.81 L\"");
  const Attributes given = read_attributes(call, 2);
  luaL_checkstack(call.L, static_cast<int>(words.size()) + 20, "too many names");
  std::vector<Expr> leaves;
  for (const std::string& word : words) {
    const auto equals = word.find('=');
    const std::string name = word.substr(0, equals);
    check_free_name(name);
    std::optional<Expr> value;
    if (equals != std::string::npos) value = parse_number(word.substr(equals + 1));
    leaves.push_back(symbol(Kind::parameter, name));
    attributes(leaves.back()).value = value;
    set_attributes({&leaves.back(), 1}, given);
  }
  for (Expr leaf : newly_declared(leaves)) push_expr(call.L, leaf);
  return static_cast<int>(words.size());
}

int func(Call& call) {
  const std::string name = call.string(1, "name");
  check_free_name(name);
  const long outputs = call.integer(2, "outputs", 1);
  if (outputs < 1 || outputs > 1000)
    throw Error(text("the number of outputs must be between 1 and 1000, not ", outputs));
  static_cast<void>(symbol(Kind::slot, name));  // rejects invalid names
  return call.push(
      std::make_shared<const UnspecifiedFunction>(UnspecifiedFunction{name, static_cast<int>(outputs)}));
}

int apply_func(Call& call) {
  const auto& f = call.object<UnspecifiedFunction>(1, "function");
  if (call.count() < 2) throw Error(text("'", f.name, "' needs at least one argument"));
  FunctionCall application;
  for (int i = 2; i <= call.count(); ++i) {
    const VecX argument = to_column(call.L, i, text("argument ", i - 1, " of ", f.name));
    application.groups.push_back(static_cast<int>(argument.size()));
    application.arguments.insert(application.arguments.end(), argument.data(),
                                 argument.data() + argument.size());
  }
  application.partial.assign(application.arguments.size(), 0);
  VecX outputs(f.outputs);
  for (int k = 0; k < f.outputs; ++k) {
    application.name = output_name(f, k);
    outputs[k] = pendula::call(application);
  }
  return push_value(call.L, MatX(outputs));
}

int func_tostring(Call& call) {
  const auto& f = call.object<UnspecifiedFunction>(1, "function");
  return call.push(
      text(f.name, ": an unspecified function with ", f.outputs, f.outputs == 1 ? " output" : " outputs"));
}

int time(Call& call) { return push_expr(call.L, time_symbol()); }
int number_pi(Call& call) { return push_expr(call.L, pi()); }
int rational(Call& call) {
  const Expr p = to_expr(call.L, 1, "the number");
  return push_expr(call.L, call.has(2) ? p / to_expr(call.L, 2, "the denominator") : p);
}

}  // namespace

extern const Module symbols_module = {
    "expressions",
    "Symbols and expressions",
    {
        {"=t", time, "t", "The independent variable: time.", "diff(t^2, t)", "2 t"},
        {"=pi", number_pi, "pi", "The number π as a symbol; math.pi is its double.", "evaluate(cos(pi))",
         "-1.0"},
        {"var", var, "var(name [, size] [, {unit =, text =}]) -> symbol or column",
         "An unknown function of time, or a column of them: var(\"q\", 3) has the entries "
         "q1, q2, q3. Unit and text appear on axes and in ledgers.",
         "q = var(\"q\", 3); q.T*q", "qᵀq", &symbol_options},
        {"vars", vars, "vars(\"x y z\" [, {unit =, text =}]) -> x, y, z",
         "Several unknown functions of time.", "x, y = vars \"x y\"; diff(x^2*y, x)", "2 x y",
         &symbol_options},
        {"param", param, "param(name [, value] [, {unit =, text =, positive =}]) -> symbol or column",
         "A constant with a default value: a number, \"1/3\", or a list for a column; also "
         "param \"L=2\". With positive = true simplify knows that it is greater than 0: |L| = "
         "L, √(L²) = L. Without a value it must be given later.",
         "L = param(\"L\", 2); evaluate(L^2)", "4.0", &symbol_options},
        {"params", params, "params(\"m=1 g=9.81 L\" [, {positive =}]) -> m, g, L",
         "Several constants, with or without default values; positive = true says that all are greater than 0.",
         "m, g = params \"m=1/2 g=9.81\"; evaluate(m*g)", "4.905", &symbol_options},
        {"input", input, "input(name [, size] [, {unit =, text =}]) -> symbol or column",
         "A known function of time (or a column), given at init and integration.", "u = input(\"u\", 2); #u",
         "2", &symbol_options},
        {"inputs", inputs, "inputs(\"u w\" [, {unit =, text =}]) -> u, w", "Several known functions of time.",
         "u, w = inputs \"u w\"; der(u*w)", "w u′ + u w′", &symbol_options},
        {"func", func, "func(name [, outputs]) -> function",
         "An unspecified function: g(x, z) is an expression with formal partial derivatives; "
         "arguments are scalars or columns, several outputs make a column.",
         "x, z = vars \"x z\"; g = func \"g\"; g(x, z)", "g(x, z)"},
        {"func:__call", apply_func, "g(x, …)", "The function applied to scalars or columns.",
         "g, x = func(\"g\", 1), var \"x\"; g(2*x)", "g(2 x)"},
        {"func:__tostring", func_tostring, "tostring(g)", "Name and number of outputs."},
        {"rational", rational, "rational(p [, q]) -> number",
         "An exact number from text such as \"1/3\", or p/q.", "rational \"1/3\" + rational \"1/6\"", "1/2"},
    }};

}  // namespace pendula::lua
