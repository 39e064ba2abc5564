// Polynomials and rational functions of expressions: factors, common denominators, coefficients.
#include "base/error.hpp"
#include "expr/polynomial/rational_form.hpp"
#include "expr/print/print.hpp"
#include "lua/core/call.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {
namespace {

Expr leaf(Call& call, int index, const char* name) {
  const Expr x = to_expr(call.L, index, name);
  if (!x.is_symbol()) throw Error(text(name, " must be a symbol, got '", to_text(x), "'"));
  return x;
}

int factor(Call& call) { return push_expr(call.L, factored(to_expr(call.L, 1, "e"))); }

/// { { factor, multiplicity }, … } of the numerator.
int factors(Call& call) {
  lua_State* L = call.L;
  const auto list = numerator_factors(to_expr(L, 1, "e"));
  lua_createtable(L, static_cast<int>(list.size()), 0);
  lua_Integer i = 0;
  for (const auto& [base, exponent] : list) {
    lua_createtable(L, 2, 0);
    push_expr(L, base);
    lua_rawseti(L, -2, 1);
    lua_pushinteger(L, exponent);
    lua_rawseti(L, -2, 2);
    lua_rawseti(L, -2, ++i);
  }
  return 1;
}

int fraction(Call& call) {
  const Quotient q = quotient_of(to_expr(call.L, 1, "e"));
  push_expr(call.L, q.numerator);
  push_expr(call.L, q.denominator);
  return 2;
}

int together(Call& call) {
  const Quotient q = quotient_of(to_expr(call.L, 1, "e"));
  return push_expr(call.L, q.numerator / q.denominator);
}

int coefficients(Call& call) {
  const Expr e = to_expr(call.L, 1, "e"), x = leaf(call, 2, "x");
  const auto list = polynomial_coefficients(e, x);
  if (!list) throw Error(text(to_text(e), " is not a polynomial in ", to_text(x)));
  lua_createtable(call.L, static_cast<int>(list->size()), 0);
  for (std::size_t k = 0; k < list->size(); ++k) {
    push_expr(call.L, (*list)[k]);
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(k) + 1);
  }
  return 1;
}

/// The name of the outermost operation of e ("sin"; "" for a symbol or number) and its operands.
int operation(Call& call) {
  const Expr e = to_expr(call.L, 1, "e");
  const bool leaf = e.is_constant() || e.is_symbol() || e.op() == Op::call || e.op() == Op::solve;
  lua_pushstring(call.L, leaf ? "" : info(e.op()).name);
  if (leaf) return 1;
  for (Expr operand : e.operands()) push_expr(call.L, operand);
  return 1 + static_cast<int>(e.operands().size());
}

int undifferentiated(Call& call) {
  const Symbol& s = symbol_of(leaf(call, 1, "x"));
  push_expr(call.L, s.base);
  lua_pushinteger(call.L, s.order);
  return 2;
}

int symbols_in(Call& call) {
  const MatX m = to_matrix(call.L, 1, "e");
  lua_newtable(call.L);
  lua_Integer i = 0;
  for (Expr s : leaves(entries(m)))
    if (symbol_of(s).kind != Kind::constant) {
      push_expr(call.L, s);
      lua_rawseti(call.L, -2, ++i);
    }
  return 1;
}

/// { { coefficient, { base, exponent }, … }, … }.
int terms(Call& call) {
  lua_State* L = call.L;
  const auto list = separated_terms(to_expr(L, 1, "e"), leaf(call, 2, "x"));
  lua_newtable(L);
  lua_Integer i = 0;
  for (const SeparatedTerm& t : list) {
    lua_newtable(L);
    push_expr(L, t.coefficient);
    lua_rawseti(L, -2, 1);
    lua_Integer k = 1;
    for (const auto& [base, exponent] : t.factors) {
      lua_newtable(L);
      push_expr(L, base);
      lua_rawseti(L, -2, 1);
      push_expr(L, Expr(exponent));
      lua_rawseti(L, -2, 2);
      lua_rawseti(L, -2, ++k);
    }
    lua_rawseti(L, -2, ++i);
  }
  return 1;
}

}  // namespace

extern const Module polynomial_module = {
    "polynomials",
    "Polynomials and rational functions",
    {
        {"factor", factor, "factor(e) -> expression",
         R"(e in irreducible factors over the rational numbers, numerator and denominator; common factors are
            cancelled.)",
         "x, y = vars \"x y\"  return factor(x^3 - x*y^2)", "x (x + y) (x - y)"},
        {"factors", factors, "factors(e) -> list of { factor, multiplicity }",
         "The irreducible factors of the numerator of e, constants left out.",
         "x = var \"x\"  return #factors(x^2*(x - 1)/(x + 2))", "2"},
        {"together", together, "together(e) -> expression",
         "e as one quotient of polynomials without a common factor, both multiplied out.",
         "x = var \"x\"  return together(1/(x - 1) - 1/(x + 1))", "2/(x² - 1)"},
        {"fraction", fraction, "fraction(e) -> numerator, denominator",
         "Numerator and denominator of together(e).", "x = var \"x\"  n, d = fraction(1/x + x)  return d",
         "x"},
        {"coefficients", coefficients, "coefficients(e, x) -> list",
         "c₀, c₁ … cₙ of a polynomial in x, which may have other symbols in its coefficients.",
         "x, a = vars \"x a\"  return coefficients((x + a)^2, x)[2]", "2 a"},
        {"terms", terms, "terms(e, x) -> list of { coefficient, { base, exponent }, … }",
         R"(The terms of a sum: a coefficient without x, and the factors that contain x. expand(e) multiplies
            products of sums out before.)",
         "x, a = vars \"x a\"  return #terms(a*x^2*sin(x) + 1, x)", "2"},
        {"symbols_in", symbols_in, "symbols_in(e) -> list",
         "The symbols that an expression or matrix contains.",
         "x, a = vars \"x a\"  return symbols_in(a*sin(x))[2]", "a"},
        {"undifferentiated", undifferentiated, "undifferentiated(x) -> symbol, order",
         "The unknown or input that a derivative belongs to, and the order of the derivative.",
         "x = var \"x\"  return undifferentiated(x.ddot)", "x 2"},
        {"operation", operation, "operation(e) -> name, operands …",
         R"(The operation on top of an expression, "sin" or "add", and its operands; "" of numbers and
            symbols.)",
         "x = var \"x\"  return operation(sin(2*x))", "sin 2 x"},
    }};

}  // namespace pendula::lua
