// The types "stability" and "conditions": the analysis of a method. Reads arguments, calls src/integrate.
#include "method/stability.hpp"

#include <cmath>
#include <optional>

#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/integrate/tableau.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"
#include "method/collocation.hpp"
#include "method/order_conditions.hpp"

namespace pendula::lua {

/// The order conditions of a method.
struct Conditions {
  std::string method;
  std::vector<integrate::OrderCondition> list;
};

template <>
struct TypeName<integrate::Stability> {
  static constexpr const char* value = "stability_function";
};
template <>
struct TypeName<Conditions> {
  static constexpr const char* value = "conditions";
};

namespace {

using integrate::Polynomial;
using integrate::Rosenbrock;
using integrate::Stability;
using integrate::Surd;
using integrate::Tableau;

// ── stability ─────────────────────────────────────────────────────────────────────────────────────────

const Stability& stability_of(Call& call) { return call.object<Stability>(1, "stability"); }
Expr z_leaf() { return symbol(Kind::parameter, "z"); }

int tableau_stability(Call& call) {
  return call.push(std::make_shared<const Stability>(call.object<Tableau>(1, "tableau")));
}
int rosenbrock_stability(Call& call) {
  return call.push(std::make_shared<const Stability>(call.object<Rosenbrock>(1, "method")));
}

int R(Call& call) {
  const Stability& stability = stability_of(call);
  const Expr p = stability.numerator(z_leaf()), q = stability.denominator(z_leaf());
  return push_expr(call.L, q.is_one() ? p : p / q);
}
int P(Call& call) { return push_expr(call.L, stability_of(call).numerator(z_leaf())); }
int Q(Call& call) { return push_expr(call.L, stability_of(call).denominator(z_leaf())); }
int formula(Call& call) { return call.push(stability_of(call).formula()); }
int exact(Call& call) { return call.push(stability_of(call).is_exact()); }
int real_limit(Call& call) { return call.push(stability_of(call).real_limit()); }
int imaginary_limit(Call& call) { return call.push(stability_of(call).imaginary_limit()); }
int alpha(Call& call) { return call.push(stability_of(call).alpha_degrees()); }
int infinity(Call& call) { return call.push(stability_of(call).at_infinity()); }
int a_stable(Call& call) { return call.push(stability_of(call).is_a_stable()); }
int l_stable(Call& call) { return call.push(stability_of(call).is_l_stable()); }
int stability_order(Call& call) { return call.push(stability_of(call).order()); }

int error_constant(Call& call) {
  const Surd constant = stability_of(call).error_constant();
  if (stability_of(call).is_exact()) return push_expr(call.L, constant.expr());
  return call.push(constant.value());
}

int stability_value(Call& call) {
  const std::complex<double> z(call.number(2, "x"), call.number(3, "y", 0));
  const std::complex<double> r = stability_of(call)(z);
  call.push(r.real());
  if (!call.has(3)) return 1;
  call.push(r.imag());
  return 2;
}

int boundary(Call& call) {
  const long angles = call.integer(2, "angles", 360);
  if (angles < 3 || angles > 100000) throw Error("angles must be between 3 and 100000");
  const auto points = stability_of(call).boundary(static_cast<int>(angles));
  Mat rows(static_cast<Eigen::Index>(points.size()), 2);
  for (std::size_t i = 0; i < points.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) << points[i].real(), points[i].imag();
  return push_matrix(call.L, rows);
}

std::string interval(double limit, const char* left, const char* right) {
  return std::isinf(limit) ? left : limit == 0 ? "y = 0 only" : text(right, rounded(std::fabs(limit), 13));
}

int stability_text(Call& call) {
  const Stability& s = stability_of(call);
  const double at_infinity = s.at_infinity();
  std::string result = text("R(z) = ", s.formula(), s.is_exact() ? "" : "  (rounded)", "\n");
  const double real = s.real_limit();
  result += "real axis        |R| ≤ 1 on " +
            (std::isinf(real) ? std::string("(-∞, 0]") : text("[", rounded(real, 13), ", 0]")) + "\n";
  result += "imaginary axis   |R| ≤ 1 for " + interval(s.imaginary_limit(), "all y", "|y| ≤ ") + "\n";
  result += text("at infinity      R(∞) = ",
                 std::isinf(at_infinity) ? (at_infinity < 0 ? "-∞" : "∞") : rounded(at_infinity, 10), "\n");
  result +=
      text("A-stable         ",
           s.is_a_stable()         ? "yes"
           : s.alpha_degrees() > 0 ? text("no, A(α)-stable with α = ", rounded(s.alpha_degrees(), 6), "°")
                                   : "no",
           "\n");
  result += text("L-stable         ", s.is_l_stable() ? "yes" : "no", "\n");
  const Surd constant = s.error_constant();
  std::string C = s.is_exact() ? to_text(constant.expr()) : rounded(constant.value(), 6);
  if (!constant.is_rational()) C = "(" + C + ")";
  result += text("error            e^z - R(z) = ", C, "·z", superscript(s.order() + 1), " + …");
  return call.push(result);
}

// ── order conditions ──────────────────────────────────────────────────────────────────────────────────

const Conditions& conditions(Call& call) { return call.object<Conditions>(1, "conditions"); }

const OptionTable condition_options = {
    {"embedded", "boolean", "false", "those of the embedded method"},
};

int order_conditions(Call& call) {
  const Tableau& tab = call.object<Tableau>(1, "tableau");
  const long fallback = std::min(tab.order() + 1, 6);
  const Options options = call.options(3);
  auto list = std::make_shared<Conditions>();
  list->method = tab.name();
  list->list = integrate::order_conditions(tab, static_cast<int>(call.integer(2, "order", fallback)),
                                           options.boolean("embedded", false));
  return call.push(std::shared_ptr<const Conditions>(std::move(list)));
}

void set_number(lua_State* L, const char* key, const std::optional<Surd>& value, double rounded_value) {
  if (value)
    push_expr(L, value->expr());
  else
    lua_pushnumber(L, rounded_value);
  lua_setfield(L, -2, key);
}

int condition_item(Call& call) {
  const auto& list = conditions(call).list;
  const long i = call.integer(2, "index");
  if (i < 1 || i > static_cast<long>(list.size()))
    throw Error(text("there are ", list.size(), " conditions; number ", i, " does not exist"));
  const integrate::OrderCondition& c = list[i - 1];
  lua_createtable(call.L, 0, 7);
  lua_pushinteger(call.L, c.order);
  lua_setfield(call.L, -2, "order");
  lua_pushboolean(call.L, c.met);
  lua_setfield(call.L, -2, "met");
  const auto fraction = [](const std::optional<Surd>& exact, double number) {
    if (!exact) return rounded(number, 6);
    return exact->is_rational() ? exact->rational_part().get_str() : to_text(exact->expr());
  };
  for (const auto& [key, words] : {std::pair{"tree", c.name}, std::pair{"formula", c.formula},
                                   std::pair{"text", c.formula + " = " + c.target.get_str()},
                                   std::pair{"residual_text", fraction(c.exact_residual, c.residual)}}) {
    lua_pushlstring(call.L, words.data(), words.size());
    lua_setfield(call.L, -2, key);
  }
  set_number(call.L, "target", Surd(c.target), 0);
  set_number(call.L, "value", c.exact_value, c.value);
  set_number(call.L, "residual", c.exact_residual, c.residual);
  return 1;
}

int condition_count(Call& call) { return call.push(static_cast<long>(conditions(call).list.size())); }

std::string shown(const std::optional<Surd>& value, double number) {
  if (!value) return rounded(number, 6);
  const std::string exact = value->is_rational() ? value->rational_part().get_str() : to_text(value->expr());
  return display_width(exact) <= 24 ? exact : rounded(number, 6);
}

int conditions_text(Call& call) {
  Table table;
  table.row({"order", "tree", "condition", "", "value", "residual"});
  int met = 0;
  for (const integrate::OrderCondition& c : conditions(call).list) {
    met += c.met;
    table.row({text(c.order), c.name, text(c.formula, " = ", c.target.get_str()), c.met ? "✓" : "✗",
               shown(c.exact_value, c.value), c.met ? "" : shown(c.exact_residual, c.residual)});
  }
  return call.push(text(conditions(call).method, ": ", met, " of ", conditions(call).list.size(),
                        " conditions met\n", table.str(2).substr(0, table.str(2).size() - 1)));
}

// ── tableaus: properties that follow from the coefficients ─────────────────────────────────────────────

const Tableau& tableau(Call& call) { return call.object<Tableau>(1, "tableau"); }

int simplifying(Call& call) {
  const auto& c = tableau(call).coefficients();
  const auto [B, C, D] = integrate::simplifying_assumptions(c, c.b);
  lua_createtable(call.L, 0, 3);
  for (const auto& [key, number] : {std::pair{"B", B}, std::pair{"C", C}, std::pair{"D", D}}) {
    lua_pushinteger(call.L, number);
    lua_setfield(call.L, -2, key);
  }
  return 1;
}

int dae_orders(Call& call) {
  const Tableau& tab = tableau(call);
  constexpr int not_applicable = -1;
  const auto found = integrate::dae_orders(tab, Stability(tab));
  const integrate::DaeOrders o = found.value_or(integrate::DaeOrders{});
  lua_createtable(call.L, 0, 7);
  for (const auto& [key, number] :
       {std::pair{"x1", o.x1}, std::pair{"z1", o.z1}, std::pair{"x2", o.x2}, std::pair{"z2", o.z2},
        std::pair{"x3", o.x3}, std::pair{"v3", o.v3}, std::pair{"z3", o.z3}}) {
    lua_pushinteger(call.L, found ? number : not_applicable);
    lua_setfield(call.L, -2, key);
  }
  return 1;
}

int embedded_order(Call& call) {
  return call.push(tableau(call).bhat() ? tableau(call).embedded_order() : 0);
}
int dense_order(Call& call) { return call.push(tableau(call).dense() ? tableau(call).dense()->order : 0); }
int error_norm(Call& call) { return call.push(integrate::principal_error_norm(tableau(call))); }

Expr polynomial_in(Expr variable, const Polynomial& p) {
  Expr sum;
  for (std::size_t k = 0; k < p.size(); ++k) sum += p[k].expr() * pow(variable, Expr(static_cast<long>(k)));
  return sum;
}

/// { ell = { ℓ₁, … }, L = { L₁, … } } as expressions in tau.
int lagrange(Call& call) {
  const Tableau& tab = tableau(call);
  const Expr tau = symbol(Kind::parameter, "tau");
  const auto basis = integrate::exact_lagrange(tab);
  const Mat rounded_basis = basis ? Mat() : integrate::lagrange(tab);
  lua_createtable(call.L, 0, 2);
  for (const bool integral : {false, true}) {
    lua_createtable(call.L, tab.stages(), 0);
    for (int j = 0; j < tab.stages(); ++j) {
      if (basis) {
        const auto& list = integral ? basis->integral : basis->ell;
        push_expr(call.L, polynomial_in(tau, list[j]));
      } else {
        Expr sum;
        for (int k = 0; k < tab.stages(); ++k)
          sum += integral ? Expr(rounded_basis(j, k) / (k + 1)) * pow(tau, Expr(k + 1))
                          : Expr(rounded_basis(j, k)) * pow(tau, Expr(k));
        push_expr(call.L, sum);
      }
      lua_seti(call.L, -2, j + 1);
    }
    lua_setfield(call.L, -2, integral ? "L" : "ell");
  }
  return 1;
}

/// ∫₀¹ ∏(τ - cᵢ) τ^k dτ, k = 0 … count - 1, as a list.
int orthogonality(Call& call) {
  const Tableau& tab = tableau(call);
  const long count = call.integer(2, "count", tab.stages());
  if (count < 1 || count > 100) throw Error("count must be between 1 and 100");
  const auto exact_values = integrate::exact_orthogonality_integrals(tab, static_cast<int>(count));
  const auto values = integrate::orthogonality_integrals(tab.coefficients(), static_cast<int>(count));
  const double unit = tab.coefficients().unit;
  lua_createtable(call.L, static_cast<int>(count), 0);
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (exact_values)
      push_expr(call.L, (*exact_values)[k].expr());
    else
      push_expr(call.L, Expr(abs(values[k]) <= 16 * unit ? 0.0 : integrate::nearest_double(values[k])));
    lua_seti(call.L, -2, static_cast<lua_Integer>(k) + 1);
  }
  return 1;
}

/// { order =, b = matrix (stages × degree), A =, c = } or nil.
int dense(Call& call) {
  const auto& output = tableau(call).dense();
  if (!output) return call.push_nil();
  lua_createtable(call.L, 0, 4);
  lua_pushinteger(call.L, output->order);
  lua_setfield(call.L, -2, "order");
  push_matrix(call.L, output->b);
  lua_setfield(call.L, -2, "b");
  if (output->extra() > 0) {
    push_matrix(call.L, output->A);
    lua_setfield(call.L, -2, "A");
    push_matrix(call.L, Mat(output->c));
    lua_setfield(call.L, -2, "c");
  }
  return 1;
}

}  // namespace

extern const Module stability_module = {
    "stability",
    "Stability and order of methods",
    {
        {"tableau:stability", tableau_stability, "tab:stability() -> stability_function",
         "R(z) = P(z)/Q(z), exact where it can be, the limits on both axes, A-, A(α)- and L-stability.",
         "rk.radau(2):stability().formula", "(1 + z/3)/(1 - 2z/3 + z²/6)"},
        {"rosenbrock:stability", rosenbrock_stability, "method:stability() -> stability_function",
         "The same for a Rosenbrock method.", "rosenbrock.rodas4:stability().L_stable", "true"},
        {"stability_function#R", R, "stability.R -> expression", "R as an expression in the parameter z.", "",
         ""},
        {"stability_function#P", P, "stability.P -> expression", "The numerator of R.", "", ""},
        {"stability_function#Q", Q, "stability.Q -> expression", "The denominator of R.", "", ""},
        {"stability_function#formula", formula, "stability.formula -> string", "R as a textbook writes it.",
         "", ""},
        {"stability_function#exact", exact, "stability.exact -> boolean", "Whether P and Q are exact.", "",
         ""},
        {"stability_function#real", real_limit, "stability.real -> number",
         "x < 0: |R| ≤ 1 on [x, 0] and no further; -inf for the whole axis.", "rk.rk4:stability().real",
         "-2.7852935634053"},
        {"stability_function#imaginary", imaginary_limit, "stability.imaginary -> number",
         "y: |R(iη)| ≤ 1 for |η| ≤ y and no further; inf for the whole axis.", "", ""},
        {"stability_function#alpha", alpha, "stability.alpha -> degrees",
         "|R| ≤ 1 in the sector |arg(-z)| ≤ α; 90 if A-stable.", "", ""},
        {"stability_function#infinity", infinity, "stability.infinity -> number", "R(∞).", "", ""},
        {"stability_function#A_stable", a_stable, "stability.A_stable -> boolean",
         "|R| ≤ 1 in the left half-plane.", "", ""},
        {"stability_function#L_stable", l_stable, "stability.L_stable -> boolean", "A-stable and R(∞) = 0.",
         "", ""},
        {"stability_function#order", stability_order, "stability.order -> integer",
         "q in e^z - R(z) = C z^(q+1) + higher powers.", "", ""},
        {"stability_function#error_constant", error_constant, "stability.error_constant -> number",
         "C of the same.", "", ""},
        {"stability_function:__call", stability_value, "stability(x [, y]) -> R or Re R, Im R",
         "R at a real z = x, or its two parts at z = x + iy.", "rk.implicit_euler:stability()(-1)", "0.5"},
        {"stability_function:boundary", boundary, "stability:boundary([angles]) -> matrix",
         R"(Points with |R| = 1 as rows (Re z, Im z): closed curves, with a row of NaN between one and the
            next.)",
         R"(
             b = rk.rk4:stability():boundary(100)
             b.cols)",
         "2"},
        {"stability_function:__tostring", stability_text, "print(stability)", "R and the verdicts.", "", ""},
        {"tableau:conditions", order_conditions,
         "tab:conditions([order [, { embedded = true }]]) -> conditions",
         R"(The order conditions of all trees up to an order (default: one more than the order, at most 6)
            with values and residuals.)",
         "#rk.rk4:conditions(5), rk.rk4:conditions(5)[9].met", "17 false", &condition_options},
        {"conditions:__index", condition_item, "conditions[i] -> table",
         R"(Condition i: order, tree, formula, target, value, residual, met; text and residual_text for
            printing.)",
         R"(
             c = rk.rk4:conditions(4)
             c[2].formula, c[2].target, c[2].met)",
         "bᵀc 1/2 true"},
        {"conditions:__len", condition_count, "#conditions", "The number of conditions.", "", ""},
        {"conditions:__tostring", conditions_text, "print(conditions)", "The table of conditions.", "", ""},
        {"tableau:simplifying", simplifying, "tab:simplifying() -> { B =, C =, D = }",
         "The largest p, q, r for which the simplifying assumptions B(p), C(q), D(r) hold.", R"(
             s = rk.radau(2):simplifying()
             s.B, s.C, s.D)",
         "3 2 1"},
        {"tableau:dae_orders", dae_orders, "tab:dae_orders() -> table",
         R"(The orders to expect on DAEs of index 1 (x1, z1), 2 (x2, z2) and 3 (x3, v3, z3) solved as they
            stand; 0: no convergence in general, -1: not applicable.)",
         "rk.radau(3):dae_orders().z2", "3"},
        {"tableau:embedded_order", embedded_order, "tab:embedded_order() -> integer",
         "The order with bhat in place of b; 0 without an embedded method.", "rk.dopri5:embedded_order()",
         "4"},
        {"tableau:dense_order", dense_order, "tab:dense_order() -> integer",
         "The order of the interpolant that belongs to the method; 0 without one.", "rk.dop853:dense_order()",
         "7"},
        {"tableau:error_norm", error_norm, "tab:error_norm() -> number",
         "The norm of the residuals of order p + 1, divided by σ(τ): how large the leading error is.",
         "rk.rk4:error_norm() > rk.dopri5:error_norm()", "true"},
        {"tableau:lagrange", lagrange, "tab:lagrange() -> { ell = {…}, L = {…} }",
         R"(The Lagrange polynomials of the nodes and their integrals from 0, as expressions in tau; exact
            for rational and quadratic nodes.)",
         "rk.radau(2):lagrange().ell[1]", "3/2 - 3 τ/2"},
        {"tableau:orthogonality", orthogonality, "tab:orthogonality([count]) -> list",
         R"(The integrals ∫₀¹ ∏(τ - cᵢ) τ^k dτ for k = 0, 1 and so on: the first q vanish if the
            quadrature has order s + q.)",
         "rk.trapezoid:orthogonality()[1]", "-1/6"},
        {"tableau#dense", dense, "tab.dense -> table or nil",
         R"(The interpolant: order, b (a row of coefficients of θ, θ², … per stage), A and c of extra
            stages.)",
         "", ""},
    }};

}  // namespace pendula::lua
