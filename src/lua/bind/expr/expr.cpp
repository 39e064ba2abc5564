// The `expressions` module: symbols of every kind, time derivatives, what an
// expression answers, and its operators.
#include "lua/bind/expr/expr.hpp"

#include <cstring>
#include <deque>

#include "base/text.hpp"
#include "expr/graph/assumption.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/approximation.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/expr/expr_subs.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

namespace {

// ── symbols ──

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
    {"text", "string", "", "what it is, in a few words: on axes and in ledgers"},
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

/// A declaration without options keeps what an earlier one said.
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

/// var(name [, size] [, options]) and its like.
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

/// A default is a constant: √2 becomes its decimal value here and nowhere else.
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
    attributes(leaves[i]).value = default_value(values[static_cast<Eigen::Index>(i)], name);
  set_attributes(leaves, given);
  return push_matrix(call.L, MatX(column(leaves)));
}

/// "m = 1" and "m=1" are one word.
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
  static_cast<void>(symbol(Kind::slot, name));  // refuses what is not a name
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

// ── derivatives in time ──

int push_derivative(Call& call, int order) {
  if (call.is<Equation>(1)) {
    Equation equation = call.object<Equation>(1, "equation");
    for (MatX* side : {&equation.lhs, &equation.rhs})
      *side = MatX(side->unaryExpr([&](Expr e) { return total_derivative(e, order); }));
    return push_equation(call.L, std::move(equation));
  }
  Value value = to_value(call.L, 1, "e");
  if (order == 0) return push(call.L, value);
  if (MatX* m = std::get_if<MatX>(&value))
    return push_value(call.L, MatX(m->unaryExpr([&](Expr e) { return total_derivative(e, order); })));
  if (Mat* m = std::get_if<Mat>(&value)) return push_matrix(call.L, Mat(Mat::Zero(m->rows(), m->cols())));
  return push_expr(call.L, std::holds_alternative<double>(value)
                               ? Expr(0)
                               : total_derivative(std::get<Expr>(value), order));
}

int der(Call& call) {
  const long order = call.integer(2, "n", 1);
  if (order < 0 || order > 100)
    throw Error(text("the order of a derivative must be between 0 and 100, not ", order));
  return push_derivative(call, static_cast<int>(order));
}
int dot(Call& call) { return push_derivative(call, 1); }
int ddot(Call& call) { return push_derivative(call, 2); }

// ── what a scalar answers ──

int itself(Call& call) {
  lua_settop(call.L, 1);
  return 1;
}
int one(Call& call) { return call.push(1); }

int index(Call& call) {
  if (lua_isinteger(call.L, 2)) {
    if (lua_tointeger(call.L, 2) != 1)
      throw Error(text("index ", lua_tointeger(call.L, 2), " is out of range: a scalar has 1 entry"));
    return itself(call);
  }
  lua_pushnil(call.L);
  return 1;
}

int name_of(Call& call) {
  const Expr e = to_expr(call.L, 1, "e");
  if (!e.is_symbol()) throw Error(text("only symbols have a name; this is the expression ", to_text(e)));
  return call.push(leaf_name(e));
}
int kind_of(Call& call) {
  static const char* const names[] = {"time", "variable", "input", "parameter", "constant", "slot"};
  const Expr e = to_expr(call.L, 1, "e");
  return call.push(e.is_symbol() ? names[static_cast<int>(symbol_of(e).kind)] : "expression");
}
int unit_of(Call& call) {
  const Expr e = to_expr(call.L, 1, "e");
  return call.push(e.is_symbol() ? symbol_of(e).unit : "");
}
int label(Call& call) { return call.push(label_of(to_expr(call.L, 1, "e"))); }

int default_of(Call& call) {
  const Expr e = to_expr(call.L, 1, "e");
  if (e.is_symbol() && symbol_of(e).value) return push_expr(call.L, *symbol_of(e).value);
  lua_pushnil(call.L);
  return 1;
}

int approximation(Call& call) { return call.push(decimal_approximation(to_expr(call.L, 1, "e"))); }

int to_string(Call& call) {
  collect_aliases(call.L);
  return call.push(to_text(to_expr(call.L, 1, "e")));
}

// ── operators ──

/// 2*x * G: the type of the right operand (a linear system, a complex number) says what the operator means.
bool right_operand_knows(Call& call) {
  const std::string type = object_type(call.L, 2);
  if (type.empty() || type == TypeName<Expr>::value || type == TypeName<Matrix>::value ||
      type == TypeName<Equation>::value)
    return false;
  if (!push_member(call.L, type.c_str(), std::strchr(call.row.name, ':') + 1)) return false;
  lua_pushvalue(call.L, 1);
  lua_pushvalue(call.L, 2);
  protected_call(call.L, 2, 1);
  return true;
}

template <Value (*operation)(const Value&, const Value&)>
int binary(Call& call) {
  if (right_operand_knows(call)) return 1;
  return push(call.L,
              operation(to_value(call.L, 1, "the left operand"), to_value(call.L, 2, "the right operand")));
}

int negative(Call& call) { return push(call.L, product(Expr(-1), to_value(call.L, 1, "the operand"))); }

Value scalar_or_matrix(const MatX& m) { return m.size() == 1 ? Value(m(0, 0)) : Value(m); }

/// Both sides in one shape: 0 ~ C means that every entry of C is zero.
int equate(Call& call) {
  for (int i : {1, 2})
    if (call.is<Equation>(i)) throw Error("an equation has one ~; write two equations for a = b = c");
  MatX lhs = to_matrix(call.L, 1, "the left side"), rhs = to_matrix(call.L, 2, "the right side");
  const auto is_zero = [](const MatX& m) { return m.size() == 1 && m(0, 0).is_zero(); };
  if (is_zero(lhs)) lhs = MatX::Zero(rhs.rows(), rhs.cols());
  if (is_zero(rhs)) rhs = MatX::Zero(lhs.rows(), lhs.cols());
  if (lhs.rows() != rhs.rows() || lhs.cols() != rhs.cols())
    throw Error(text("the left side is a ", shape(scalar_or_matrix(lhs)), ", the right side a ",
                     shape(scalar_or_matrix(rhs))));
  return push_equation(call.L, {lhs, rhs});
}

[[noreturn]] void no_order(const char* remedy) {
  throw Error(text("a condition on symbols is an expression: write ", remedy,
                   " (also le, ge; all, any), as in ifelse(lt(x, 0), p, q)"));
}

int compare(Call& call, bool strict) {
  for (int i : {1, 2})
    if (call.is<Matrix>(i) || lua_istable(call.L, i)) throw Error("matrices have no order; compare entries");
  const auto a = number_value(to_expr(call.L, 1, "the left operand"));
  const auto b = number_value(to_expr(call.L, 2, "the right operand"));
  if (!a || !b)
    no_order(strict ? "lt(a, b) for a < b and gt(a, b) for a > b"
                    : "le(a, b) for a <= b and ge(a, b) for a >= b");
  return call.push(strict ? *a < *b : *a <= *b);
}
int less(Call& call) { return compare(call, true); }
int less_or_equal(Call& call) { return compare(call, false); }

/// ⌊a/b⌋ of two numbers, exact where both are; nothing where there are symbols.
std::optional<Expr> floor_of_quotient(Expr a, Expr b) {
  const auto x = number_value(a), y = number_value(b);
  if (!x || !y) return {};
  if (*y == 0) throw Error("division by zero");
  const mpq_class *p = exact_value(a), *q = exact_value(b);
  if (!p || !q) return Expr(std::floor(*x / *y));
  const mpq_class quotient = *p / *q;
  mpz_class floor;
  mpz_fdiv_q(floor.get_mpz_t(), quotient.get_num_mpz_t(), quotient.get_den_mpz_t());
  return Expr(mpq_class(floor));
}

int floor_division(Call& call) {
  const auto floor =
      floor_of_quotient(to_expr(call.L, 1, "the left operand"), to_expr(call.L, 2, "the right operand"));
  if (!floor) throw Error("expressions have no //; write a/b");
  return push_expr(call.L, *floor);
}
int remainder(Call& call) {
  const Expr a = to_expr(call.L, 1, "the left operand"), b = to_expr(call.L, 2, "the right operand");
  const auto floor = floor_of_quotient(a, b);
  if (!floor) throw Error("expressions have no %; for a periodic function write sin, cos or ifelse");
  return push_expr(call.L, a - *floor * b);
}
int no_and(Call&) { throw Error("expressions have no &; for conditions write all(a, b)"); }
int no_or(Call&) { throw Error("expressions have no |; for conditions write any(a, b)"); }
int no_shift(Call&) { throw Error("expressions have no << and >>; for conditions write lt(a, b), gt(a, b)"); }
int no_not(Call&) {
  throw Error("~ stands between two sides: write 0 ~ x; for a difference write lhs ~= rhs");
}

int no_call(Call& call) {
  const Expr e = call.object<Expr>(1, "e");
  if (call.count() == 2 && lua_type(call.L, 2) == LUA_TSTRING && lua_rawlen(call.L, 2) == 0)  // x''
    throw Error(text("two quotes are an empty text; the second derivative of ", to_text(e), " is ",
                     to_text(e), ".ddot"));
  throw Error(text("'", to_text(e), "' is an expression and no function; its value at a time is sol(",
                   to_text(e), ", t), for given numbers evaluate(e, { x = 1 })"));
}

/// The operators of both types are the same functions.
struct Operator {
  const char* metamethod;
  Function function;
  const char* signature;
  const char* text;
};
constexpr const char* always_an_error = "Always an error that names the remedy.";
const Operator operators[] = {
    {"__add", binary<sum>, "a + b", "Sum; shapes must agree."},
    {"__sub", binary<difference>, "a - b", "Difference; shapes must agree."},
    {"__mul", binary<product>, "a * b", "Product; a 1×1 product collapses to a scalar."},
    {"__div", binary<quotient>, "a / b", "Quotient by a scalar."},
    {"__pow", binary<power>, "a ^ b", "Power; of a square matrix with an integer exponent."},
    {"__unm", negative, "-a", "Negative."},
    {"__bxor", equate, "lhs ~ rhs", "An equation. ~ binds weaker than + - * / and stronger than ==."},
    {"__lt", less, "a < b", "Order of numbers; for symbols an error that names lt and gt."},
    {"__le", less_or_equal, "a <= b", "Order of numbers; for symbols an error that names le and ge."},
    {"__idiv", floor_division, "a // b", always_an_error},
    {"__mod", remainder, "a % b", always_an_error},
    {"__band", no_and, "a & b", always_an_error},
    {"__bor", no_or, "a | b", always_an_error},
    {"__shl", no_shift, "a << b", always_an_error},
    {"__shr", no_shift, "a >> b", always_an_error},
    {"__bnot", no_not, "~a", always_an_error},
};

std::vector<Row> rows() {
  static std::deque<std::string> names;  // a Row holds pointers
  std::vector<Row> all = {
      {"=t", time, "t", "The independent variable: time.", "diff(t^2, t)", "2 t"},
      {"expr:__call", no_call, "x(t)", always_an_error},
      {"=pi", number_pi, "pi", "The number π as a symbol; math.pi is its double.", "evaluate(cos(pi))",
       "-1.0"},
      {"var", var, "var(name [, size] [, {unit =, text =}]) -> symbol or column",
       "An unknown function of time, or a column of them: var(\"q\", 3) has the entries q1, q2, q3. Unit and "
       "text "
       "appear on axes and in ledgers.",
       "q = var(\"q\", 3); q.T*q", "qᵀq", &symbol_options},
      {"vars", vars, "vars(\"x y z\" [, {unit =, text =}]) -> x, y, z", "Several unknown functions of time.",
       "x, y = vars \"x y\"; diff(x^2*y, x)", "2 x y", &symbol_options},
      {"param", param, "param(name [, value] [, {unit =, text =, positive =}]) -> symbol or column",
       "A constant with a default value: a number, \"1/3\", or a list for a column; also param \"L=2\". With "
       "positive = true simplify knows that it is greater than 0: |L| = L, √(L²) = L. "
       "Without a value it must "
       "be given "
       "later.",
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
       "An unspecified function: g(x, z) is an expression with formal partial derivatives; arguments are "
       "scalars or "
       "columns, several outputs make a column.",
       "x, z = vars \"x z\"; g = func \"g\"; g(x, z)", "g(x, z)"},
      {"func:__call", apply_func, "g(x, …)", "The function applied to scalars or columns."},
      {"func:__tostring", func_tostring, "tostring(g)", "Name and number of outputs."},
      {"rational", rational, "rational(p [, q]) -> number",
       "An exact number from text such as \"1/3\", or p/q.", "rational \"1/3\" + rational \"1/6\"", "1/2"},
      {"der", der, "der(e [, n]) -> e′",
       "The n-th total derivative in time by the chain rule, of any expression, matrix or "
       "equation.",
       "x = var \"x\"; der(sin(x))", "x′ cos(x)"},
      {"expr#dot", dot, "e.dot", "The time derivative, der(e)."},
      {"expr#ddot", ddot, "e.ddot", "The second time derivative, der(e, 2)."},
      {"matrix#dot", dot, "v.dot", "The time derivative of every entry."},
      {"matrix#ddot", ddot, "v.ddot", "The second time derivative of every entry."},
      {"expr#T", itself, "e.T", "A scalar is its own transpose."},
      {"expr#rows", one, "e.rows", "1 for a scalar."},
      {"expr#cols", one, "e.cols", "1 for a scalar."},
      {"expr#name", name_of, "x.name", "The name of a symbol: \"x\", \"q3\", \"x'\"."},
      {"expr#kind", kind_of, "x.kind",
       "\"variable\", \"input\", \"parameter\", \"time\", or \"expression\"."},
      {"expr#unit", unit_of, "x.unit", "The unit given with the symbol, or \"\"."},
      {"expr#label", label, "x.label", "The label of an axis: text or name, with the unit."},
      {"expr#value", default_of, "m.value", "The default value of a parameter, or nil."},
      {"expr:__len", one, "#e", "1 for a scalar."},
      {"expr:__index", index, "e[1]", "The scalar itself."},
      {"expr:__tostring", to_string, "tostring(e)", "The expression as in a book."},
      {"expr:__approximation", approximation, "sqrt(2) at the prompt",
       "The prompt shows √2 ≈ 1.414213562: a number with roots, π or functions in it and its decimals."},
  };
  for (const char* type : {"expr", "matrix"})
    for (const Operator& op : operators)
      all.push_back(
          {names.emplace_back(text(type, ":", op.metamethod)).c_str(), op.function, op.signature, op.text});
  return all;
}

}  // namespace

extern const Module expr_module = {"expressions", "Symbols and expressions", rows()};

}  // namespace pendula::lua
