// The `calculus` module: partial derivatives, substitution, rewriting,
// evaluation, and the text of expressions.
#include <algorithm>
#include <unordered_set>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/points/rank_on_zero_set.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "lua/bind/expr/expr.hpp"
#include "lua/bind/expr/expr_evaluate.hpp"
#include "lua/bind/expr/expr_subs.hpp"
#include "lua/core/objects.hpp"
#include "lua/screen/pager.hpp"

namespace pendula::lua {
namespace {

// ── symbols ──

int symbols(Call& call) {
  if (lua_type(call.L, 1) == LUA_TSTRING)
    throw Error(
        text("symbols(e) lists the symbols of an expression; new ones are made by x, y = vars \"x y\" and "
             "params \"m=1 k\", here vars \"",
             lua_tostring(call.L, 1), "\""));
  std::vector<Expr> all;
  const auto add = [&](const MatX& m) { all.insert(all.end(), m.data(), m.data() + m.size()); };
  if (call.is<Equation>(1)) {
    add(call.object<Equation>(1, "e").lhs);
    add(call.object<Equation>(1, "e").rhs);
  } else if (!call.is<Matrix>(1) || !call.object<Matrix>(1, "e").numeric()) {
    add(to_matrix(call.L, 1, "e"));
  }
  lua_newtable(call.L);
  lua_Integer n = 0;
  std::unordered_set<Expr> seen;
  for (Expr leaf : leaves(all)) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == Kind::constant || !seen.insert(s.base).second) continue;
    push_expr(call.L, s.kind == Kind::time ? leaf : s.base);
    lua_rawseti(call.L, -2, ++n);
  }
  return 1;
}

// ── partial derivatives ──

std::vector<Expr> variables(Call& call, int i, const char* name) {
  if (!call.has(i)) call.wrong(i, name, "a symbol or a column of symbols");
  if (lua_type(call.L, i) == LUA_TNUMBER) call.wrong(i, name, "a symbol or a column of symbols");
  const MatX e = to_matrix(call.L, 1, "the expression");
  const auto known = leaves(entries(e));
  return to_leaves(call.L, i, name, known);
}

int push_jacobian(Call& call) {
  const VecX f = to_column(call.L, 1, "f");
  const auto x = variables(call, 2, "x");
  check_size(f.size(), static_cast<long>(x.size()));
  return push_value(call.L, jacobian(entries(f), x));
}

int push_gradient(Call& call) {
  const Expr e = to_expr(call.L, 1, "e");
  const auto x = variables(call, 2, "x");
  return push_value(call.L, MatX(column(gradient(e, x))));
}

int hessian(Call& call) {
  const Expr e = to_expr(call.L, 1, "e");
  const auto x = variables(call, 2, "x");
  check_size(static_cast<long>(x.size()), static_cast<long>(x.size()));
  return push_value(call.L, jacobian(gradient(e, x), x));
}

/// Rejects diff(x, t) with a variable x: it would be 0, which is never meant.
void refuse_hidden_time(const MatX& e) {
  Expr moving = 0;
  for (Expr leaf : leaves(entries(e))) {
    if (leaf == time_symbol()) return;
    const Kind kind = symbol_of(leaf).kind;
    if (kind == Kind::variable || kind == Kind::input) moving = leaf;
  }
  if (!moving.is_zero())
    throw Error(
        text("the partial derivative by t is 0, because t does not occur; the derivative by time, in which ",
             to_text(moving), " changes, is der(e)"));
}

MatX differentiated(Call& call, MatX d, int i, long order) {
  const auto x = variables(call, i, "x");
  if (x.size() != 1)
    throw Error(text("x has ", x.size(), " components; for a column write jacobian(f, x) or gradient(e, x)"));
  if (order < 0 || order > 100)
    throw Error(text("the order of a derivative must be between 0 and 100, not ", order));
  if (x[0] == time_symbol() && order > 0) refuse_hidden_time(d);
  for (long k = 0; k < order; ++k) d = d.unaryExpr([&](Expr entry) { return partial(entry, x[0]); });
  return d;
}

/// diff(e, x, 2, y): symbols, each optionally followed by the number of derivatives.
int diff(Call& call) {
  const Value e = to_value(call.L, 1, "e");
  MatX d = to_matrix(call.L, 1, "e");
  const int last = std::max(2, call.count());
  for (int i = 2; i <= last; ++i) {
    const bool counted = lua_type(call.L, i + 1) == LUA_TNUMBER;
    d = differentiated(call, std::move(d), i, counted ? call.integer(i + 1, "n") : 1);
    if (counted) ++i;
  }
  return is_matrix(e) ? push_value(call.L, d) : push_expr(call.L, d(0, 0));
}

int push_implicit_jacobian(Call& call) {
  const VecX r = to_column(call.L, 1, "r");
  const auto z = variables(call, 2, "z"), y = variables(call, 3, "y");
  const MatX slope = linalg::implicit_jacobian(entries(r), z, y);
  const dae::ZeroSetRanks there = dae::rank_on_zero_set({r.data(), r.data() + r.size()}, z);
  if (there.regular == 0 && there.singular > 1)
    throw Error(
        "∂r/∂z is regular in general, but singular at every point found where r = 0: the rank "
        "condition fails on the whole solution set and the formula does not apply (a z(y) may "
        "exist all the same: the condition is sufficient, not necessary). Does an equation hold "
        "with a vanishing gradient, as C^2 = 0 does? Write C");
  if (there.singular > 0)
    warn(
        "implicit_jacobian: r = 0 also has points where ∂r/∂z is singular; the formula does not apply there");
  return push_value(call.L, slope);
}

// ── rewriting ──

int push_simplified(Call& call) {
  return each(call, [](const MatX& m) { return MatX(m.unaryExpr([](Expr e) { return simplify(e); })); });
}
int push_expanded(Call& call) {
  return each(call, [](const MatX& m) { return MatX(m.unaryExpr([](Expr e) { return expand(e); })); });
}

// ── text ──

std::string joined_code(const MatX& m) {
  std::string code = m.cols() == 1 ? "vec{" : "mat{";
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    poll_interrupt();
    code += i ? ", " : "";
    code += m.cols() == 1 ? "" : "{";
    for (Eigen::Index j = 0; j < m.cols(); ++j) code += (j ? ", " : "") + to_code(m(i, j));
    code += m.cols() == 1 ? "" : "}";
  }
  return code + "}";
}

int code(Call& call) {
  if (call.is<Equation>(1)) {
    const auto& equation = call.object<Equation>(1, "equation");
    const auto side = [](const MatX& m) { return m.size() == 1 ? to_code(m(0, 0)) : joined_code(m); };
    return call.push(side(equation.lhs) + " ~ " + side(equation.rhs));
  }
  const MatX m = to_matrix(call.L, 1, "e");
  return call.push(call.is<Matrix>(1) || lua_istable(call.L, 1) ? joined_code(m) : to_code(m(0, 0)));
}

std::string side_text(const MatX& m, bool latex) {
  PrintOptions options = default_print_options();
  options.latex = latex;
  if (m.size() == 1) return latex ? to_latex(m(0, 0)) : to_text(m(0, 0));
  return m.cols() == 1 ? vector_to_text(m.col(0), options) : matrix_to_text(m, options);
}

int latex(Call& call) {
  collect_aliases(call.L);
  if (call.is<Equation>(1)) {
    const auto& equation = call.object<Equation>(1, "equation");
    return call.push(side_text(equation.lhs, true) + " = " + side_text(equation.rhs, true));
  }
  const std::string type = object_type(call.L, 1);
  const bool plain = type.empty() || type == "expr" || type == "matrix";
  const bool of_parts = lua_istable(call.L, 1) && luaL_getmetafield(call.L, 1, "__model") != LUA_TNIL;
  lua_settop(call.L, 1);
  if (of_parts || (!plain && has_method(call.L, type.c_str(), "latex"))) {  // models, derivations, tableaus
    lua_getfield(call.L, 1, "latex");
    lua_pushvalue(call.L, 1);
    lua_call(call.L, 1, 1);
    return 1;
  }
  return call.push(side_text(to_matrix(call.L, 1, "e"), true));
}

// ── equations ──

int equation_to_string(Call& call) {
  collect_aliases(call.L);
  const auto& equation = call.object<Equation>(1, "equation");
  return call.push(side_text(equation.lhs, false) + " = " + side_text(equation.rhs, false));
}
int lhs(Call& call) { return push_value(call.L, call.object<Equation>(1, "equation").lhs); }
int rhs(Call& call) { return push_value(call.L, call.object<Equation>(1, "equation").rhs); }
int residual(Call& call) {
  const auto& equation = call.object<Equation>(1, "equation");
  return push_value(call.L, MatX(equation.lhs - equation.rhs));
}
int equal(Call& call) {
  if (!call.is<Equation>(1) || !call.is<Equation>(2)) return call.push(false);
  const auto &a = call.object<Equation>(1, "left"), &b = call.object<Equation>(2, "right");
  const auto same = [](const MatX& x, const MatX& y) {
    return x.rows() == y.rows() && x.cols() == y.cols() && x == y;
  };
  return call.push(same(a.lhs, b.lhs) && same(a.rhs, b.rhs));
}

}  // namespace

extern const Module calculus_module = {
    "calculus",
    "Derivatives, substitution, evaluation",
    {
        {"jacobian", push_jacobian, "jacobian(f, x) -> matrix",
         "∂fᵢ/∂xⱼ; x is a symbol, a column of symbols or a list of them. x, x′, x″ count as independent.",
         R"(x, y = vars "x y"; jacobian({x*y, y}, {x, y})(1, 2))", "x"},
        {"gradient", push_gradient, "gradient(e, x) -> column", "∂e/∂xⱼ as a column.",
         R"(x, y = vars "x y"; gradient(x*y, {x, y})[1])", "y"},
        {"hessian", hessian, "hessian(e, x) -> matrix", "∂²e/∂xᵢ∂xⱼ.",
         R"(x, y = vars "x y"; hessian(x*y, {x, y})(1, 2))", "1"},
        {"diff", diff, "diff(e, x [, n], y, …) -> expression",
         "The n-th partial derivative by a symbol; several one after another, diff(e, x, 2, y).",
         R"(x, y = vars "x y"; diff(x^3, x, 3), diff(x^2*y^2, x, y))", "6 4 x y"},
        {"symbols", symbols, "symbols(e) -> list of symbols",
         "The symbols that an expression, a matrix or an equation contains, without derivatives, as declared.",
         R"(x, y = vars "x y"; #symbols(x*y + der(y) ~ t))", "3"},
        {"subs", push_substituted, "subs(e, {[x] = …}) -> expression",
         R"(Replaces symbols, columns or whole subexpressions, all at once. With x, x.dot is replaced by
            the derivative of the new expression, unless x.dot is itself a key: a constant makes it 0. For an
            unspecified function g give [g] = function(x) … end.)",
         R"(x = var "x"; subs(x.dot + x, {[x] = t^2}) == 2*t + t^2)", "true"},
        {"simplify", push_simplified, "simplify(e) -> expression",
         "Like terms and factors collected; the value is kept.",
         R"(x = var "x"; simplify(sin(x)^2 + cos(x)^2))", "1"},
        {"expand", push_expanded, "expand(e) -> expression", "Products of sums multiplied out.",
         R"(x = var "x"; expand((x + 1)*(x - 1)) == expand(x^2 - 1))", "true"},
        {"latex", latex, "latex(e) -> text", "The LaTeX text of an expression, a matrix or an equation.",
         R"(x = var "x"; latex(x))", "x"},
        {"evaluate", push_evaluated, "evaluate(e [, {x = 0.5, …}]) -> number or matrix",
         R"(The value; keys are names or symbols, columns take lists. Parameters without an entry have
            their default values. Where large terms cancel, it is computed with 320 bits.)",
         R"(x = var "x"; evaluate(x^2, {x = 0.5}))", "0.25"},
        {"fn", push_compiled, "fn(arguments, e) -> function  ·  fn(function(x, y) … end)",
         R"(A compiled numeric function: arguments are symbols or columns; f(1, 2) is a number or a matrix.
            A matrix argument holds one point per row, and so does the result. A Lua function is followed
            with symbols once and compiled: no branches on its arguments, the vocabulary's functions only.)",
         R"(x, y = vars "x y"; f = fn({x, y}, x*y); f(2, 3))", "6.0"},
        {"implicit_jacobian", push_implicit_jacobian, "implicit_jacobian(r, z, y) -> matrix",
         R"(∂z/∂y = -(∂r/∂z)⁻¹ ∂r/∂y where r(y, z) = 0. ∂r/∂z must be regular where r = 0 (checked, also at
            points of that set): sufficient for z(y) to exist, not necessary.)",
         R"(y, z = vars "y z"; implicit_jacobian(z^2 - y, z, y) == 1/(2*z))", "true"},
        {"expr:latex", latex, "e:latex()", "The LaTeX text.", R"(x = var "x"  return (x.dot^2/2):latex())",
         R"(\frac{\dot{x}^2}{2})"},
        {"expr:code", code, "e:code()", "Lua text that rebuilds e.", R"(x = var "x"  return (x^2/2):code())",
         R"(var("x")^2/2)"},
        {"matrix:latex", latex, "A:latex()", "The LaTeX text.",
         R"(x = var "x"  return mat{{1, x}, {0, 1}}:latex())",
         R"(\begin{bmatrix} 1 & x \\ 0 & 1 \end{bmatrix})"},
        {"matrix:code", code, "A:code()", "Lua text that rebuilds A.",
         R"(x = var "x"  return mat{{1, x}, {0, 1}}:code())",
         R"(mat{{rational("1"), var("x")}, {rational("0"), rational("1")}})"},
        {"equation:latex", latex, "equation:latex()", "The LaTeX text.",
         R"(x = var "x"  return (der(x) ~ -x):latex())", R"(\dot{x} = -x)"},
        {"equation:code", code, "equation:code()", "Lua text that rebuilds the equation.",
         R"(x = var "x"  return (der(x) ~ -x):code())", R"(der(var("x")) ~ -var("x"))"},
        {"equation#lhs", lhs, "equation.lhs", "The left side."},
        {"equation#rhs", rhs, "equation.rhs", "The right side."},
        {"equation:residual", residual, "equation:residual()", "Left side minus right side.",
         R"(x = var "x"; (x ~ 2):residual() == x - 2)", "true"},
        {"equation:__eq", equal, "a == b", "Same sides (structure).",
         R"(
             x = var "x"
             print((x ~ 2) == (x ~ 2)))",
         "true"},
        {"equation:__tostring", equation_to_string, "tostring(equation)", "Both sides: lhs = rhs."},
        {"fn:__call", call_compiled, "f(1, 2)", "The value at one point, or one row per point.",
         R"(
             x, y = vars "x y"
             f = fn({ x, y }, x + 2*y)
             f(1, 2), f(mat{{1, 2}, {3, 4}}).T)",
         "5.0 5  11"},
        {"fn:__tostring", compiled_to_string, "tostring(f)", "Arguments and size."},
    }};

}  // namespace pendula::lua
