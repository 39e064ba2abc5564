// The `expressions` module: time derivatives, methods and operators of expressions.
#include "lua/bind/expr/expr.hpp"

#include <cstring>
#include <deque>

#include "base/text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/approximation.hpp"
#include "expr/print/print.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

namespace {

// ── time derivatives ──

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

// ── methods of scalars ──

int itself(Call& call) {
  lua_settop(call.L, 1);
  return 1;
}
int one(Call& call) { return call.push(1); }

int same(Call& call) {
  return call.push(call.is<Expr>(1) && call.is<Expr>(2) &&
                   call.object<Expr>(1, "left") == call.object<Expr>(2, "right"));
}

int index(Call& call) {
  if (lua_isinteger(call.L, 2)) {
    if (lua_tointeger(call.L, 2) != 1)
      throw Error(text("index ", lua_tointeger(call.L, 2), " is out of range: a scalar has 1 entry"));
    return itself(call);
  }
  return call.push_nil();
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
  return call.push_nil();
}

int approximation(Call& call) { return call.push(decimal_approximation(to_expr(call.L, 1, "e"))); }

int to_string(Call& call) {
  const Expr e = to_expr(call.L, 1, "e");
  if (!e.is_symbol()) collect_aliases(call.L);
  return call.push(to_text(e));
}

// ── operators ──

/// 2*x * G: the type of the right operand (a linear system, a complex number) defines the operator.
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

/// Expands a scalar side to the shape of the other: 0 ~ C means that every entry of C is zero.
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
  // accepts math.huge and nan as well
  const auto number_at = [&](int i, const char* what) -> std::optional<double> {
    if (lua_type(call.L, i) == LUA_TNUMBER) return lua_tonumber(call.L, i);
    return number_value(to_expr(call.L, i, what));
  };
  const auto a = number_at(1, "the left operand"), b = number_at(2, "the right operand");
  if (!a || !b)
    no_order(strict ? "lt(a, b) for a < b and gt(a, b) for a > b"
                    : "le(a, b) for a <= b and ge(a, b) for a >= b");
  return call.push(strict ? *a < *b : *a <= *b);
}
int less(Call& call) { return compare(call, true); }
int less_or_equal(Call& call) { return compare(call, false); }

/// ⌊a/b⌋ of two numbers, exact if both are; empty for symbols.
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

/// Both types share the functions of their operators.
struct Operator {
  const char* metamethod;
  Function function;
  const char* signature;
  const char* text;
  const char* example;
};
constexpr const char* always_an_error = "Always an error that names the remedy.";
const Operator operators[] = {
    {"__add", binary<sum>, "a + b", "Sum; shapes must agree.",
     R"(
           x = var "x"
           x + 2*x, vec{1, x} + vec{x, 1})"},
    {"__sub", binary<difference>, "a - b", "Difference; shapes must agree.",
     R"(
           x = var "x"
           x - 3, vec{1, 2} - vec{x, x})"},
    {"__mul", binary<product>, "a * b", "Product; a 1×1 product collapses to a scalar.",
     R"(
           x = var "x"
           2*x*x, mat{{1, 2}, {3, 4}}*vec{1, x}, vec{1, x}.T*vec{1, x})"},
    {"__div", binary<quotient>, "a / b", "Quotient by a scalar.",
     R"(
           x = var "x"
           x/2, vec{1, x}/2)"},
    {"__pow", binary<power>, "a ^ b", "Power; of a square matrix with an integer exponent.",
     R"(
           x = var "x"
           x^2, mat{{1, 1}, {0, 1}}^3)"},
    {"__unm", negative, "-a", "Negative.",
     R"(
           x = var "x"
           print(-x, -vec{1, x}))"},
    {"__bxor", equate, "lhs ~ rhs", "An equation. ~ binds weaker than + - * / and stronger than ==.",
     R"(
           x = var "x"
           der(x) ~ -2*x + 1)"},
    {"__lt", less, "a < b", "Order of numbers; for symbols an error that names lt and gt.",
     R"(
           x = var "x"
           expect(function() return x < 1 end):fails "lt(a"
           x - x < 1)"},
    {"__le", less_or_equal, "a <= b", "Order of numbers; for symbols an error that names le and ge.",
     R"(
           x = var "x"
           expect(function() return x <= 1 end):fails "le(a"
           x - x <= 0)"},
    {"__idiv", floor_division, "a // b", always_an_error,
     R"(expect(function() return var "x" // 2 end):fails "write")"},
    {"__mod", remainder, "a % b", always_an_error,
     R"(expect(function() return var "x" % 2 end):fails "sin, cos or ifelse")"},
    {"__band", no_and, "a & b", always_an_error,
     R"(expect(function() return var "x" & 1 end):fails "write")"},
    {"__bor", no_or, "a | b", always_an_error, R"(expect(function() return var "x" | 1 end):fails "write")"},
    {"__shl", no_shift, "a << b", always_an_error,
     R"(expect(function() return var "x" << 1 end):fails "write")"},
    {"__shr", no_shift, "a >> b", always_an_error,
     R"(expect(function() return var "x" >> 1 end):fails "write")"},
    {"__bnot", no_not, "~a", always_an_error, R"(expect(function() return ~var "x" end):fails "write")"},
};

std::vector<Row> rows() {
  static std::deque<std::string> names;  // rows store pointers to these
  std::vector<Row> all = {
      {"expr:__call", no_call, "x(t)", always_an_error,
       R"(x = var "x"  expect(function() return x(0) end):fails "sol(x")"},
      {"der", der, "der(e [, n]) -> e′",
       "The n-th total derivative in time by the chain rule, of "
       "any expression, matrix or equation.",
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
      {"expr:__eq", same, "a == b",
       "The same structure, not the same value: simplify(a - b) decides that. An equation is a ~ b.",
       R"(
           x, y = vars "x y"
           x + y == y + x, (x + 1)^2 == x^2 + 2*x + 1)",
       "true false"},
      {"expr:__index", index, "e[1]", "The scalar itself.", "x = var \"x\"; x[1]", "x"},
      {"expr:__tostring", to_string, "tostring(e)", "The expression as in a book."},
      {"expr:__approximation", approximation, "sqrt(2) at the prompt",
       "The prompt shows √2 ≈ 1.414213562: a number with roots, π or functions in it and its decimals.",
       "sqrt(2)*pi", "π √2"},
  };
  for (const char* type : {"expr", "matrix"})
    for (const Operator& op : operators)
      all.push_back({names.emplace_back(text(type, ":", op.metamethod)).c_str(), op.function, op.signature,
                     op.text, op.example});
  return all;
}

}  // namespace

extern const Module expr_module = {"expressions", "Symbols and expressions", rows()};

}  // namespace pendula::lua
