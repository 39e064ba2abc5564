// The `pencil` module: linear systems with constant coefficients, exactly. Reads arguments, calls src/dae.
#include <algorithm>

#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/forms.hpp"
#include "dae/pencil/pencil.hpp"
#include "dae/pencil/pencil_polynomial.hpp"
#include "dae/pencil/pencil_shuffle.hpp"
#include "dae/report/structure_report.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/core/values.hpp"
#include "lua/read/inputs.hpp"

namespace pendula::lua {

/// A pencil and its model.
struct ModelPencil {
  dae::Pencil pencil;  ///< of numbers
  dae::ModelPtr model;
  std::optional<Expr> det = {};  ///< det with parameters as symbols; then nothing else is known
};
template <>
struct TypeName<ModelPencil> {
  static constexpr const char* value = "pencil";
};

namespace {

const ModelPencil& any_pencil(Call& call) { return call.object<ModelPencil>(1, "pencil"); }

const ModelPencil& pencil_of(Call& call) {
  const ModelPencil& p = any_pencil(call);
  if (p.det)
    throw Error(
        "the pencil has parameters without value: it has det, index, dof and cases, printed by print(p); "
        "the rest needs numbers, as in sys:with{ a = 1 }:pencil()");
  return p;
}

/// The pencil, for functions that are defined for regular pencils only.
const dae::Pencil& regular(Call& call, const char* what) {
  const dae::Pencil& p = pencil_of(call).pencil;
  if (!p.regular)
    throw Error(text("the pencil is singular and has no ", what, ":\n", dae::describe_singular(p)));
  return p;
}

Expr polynomial_in_s(const std::vector<Expr>& coefficients) {
  const Expr s = symbol(Kind::parameter, "s");
  Expr sum(0), power(1);
  for (Expr c : coefficients) {
    sum = sum + c * power;
    power = power * s;
  }
  return sum;
}

/// det(sE - A) in symbols; empty if the model is not linear or too large.
std::optional<Expr> polynomial_if_any(const dae::Model& m) {
  try {
    return polynomial_in_s(dae::pencil_polynomial(m));
  } catch (const UserFacing&) {
    return {};
  }
}

int make_pencil(Call& call) {
  auto result = std::make_shared<ModelPencil>();
  result->model = call.shared<dae::Model>(1, "model");
  const dae::Model& m = *result->model;
  try {
    result->pencil = dae::pencil(m);
  } catch (const UserFacing&) {
    const bool open = std::any_of(m.parameters.begin(), m.parameters.end(),
                                  [&](Expr p) { return !m.values.count(p) && !symbol_of(p).value; });
    if (open) result->det = polynomial_if_any(m);
    if (!result->det) throw;
  }
  return call.push(std::shared_ptr<const ModelPencil>(result));
}

int characteristic(Call& call) {
  const std::vector<Expr> coefficients = dae::pencil_polynomial(*call.shared<dae::Model>(1, "model"));
  push_expr(call.L, polynomial_in_s(coefficients));
  lua_createtable(call.L, static_cast<int>(coefficients.size()), 0);
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    push_expr(call.L, coefficients[k]);
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(k) + 1);
  }
  return 2;
}

/// det(sE - A), index and free initial values for generic parameter values, then the exceptions.
std::string symbolic_text(const ModelPencil& p) {
  std::string out = "det(sE - A) = " + to_text(*p.det) + ", up to its sign";
  if (p.det->is_zero()) return out + "\nthe pencil is singular for all values of its parameters";
  const dae::StructureReport report = dae::structure(p.model);
  if (report.index)
    out += text("\nfor almost all values of the parameters: index ", *report.index, ", ", *report.dof,
                *report.dof == 1 ? " free initial value" : " free initial values");
  for (const std::string& note : report.notes) out += "\n" + note;
  return out;
}

int push_rational(Call& call, const dae::RationalMatrix& m) {
  return push_matrix(call.L, dae::expressions(m));
}

int is_regular(Call& call) {
  const ModelPencil& p = any_pencil(call);
  return call.push(p.det ? !p.det->is_zero() : p.pencil.regular);
}
int rank(Call& call) { return call.push(pencil_of(call).pencil.rank); }
int det(Call& call) {
  const ModelPencil& p = any_pencil(call);
  return push_expr(call.L, p.det ? *p.det : dae::expression(p.pencil.det, symbol(Kind::parameter, "s")));
}
int pencil_dof(Call& call) {
  const ModelPencil& p = any_pencil(call);
  return call.push(p.det ? dae::differentiation_index(*p.model).dof
                         : regular(call, "degrees of freedom").dof);
}
int pencil_index(Call& call) {
  const ModelPencil& p = any_pencil(call);
  return call.push(p.det ? dae::differentiation_index(*p.model).index : regular(call, "index").index);
}
int E(Call& call) { return push_rational(call, pencil_of(call).pencil.form.E); }
int A(Call& call) { return push_rational(call, pencil_of(call).pencil.form.A); }
int B(Call& call) { return push_rational(call, pencil_of(call).pencil.form.B); }
int f(Call& call) { return push_matrix(call.L, MatX(pencil_of(call).pencil.form.f)); }
int x(Call& call) { return push_matrix(call.L, MatX(column(pencil_of(call).pencil.form.x))); }
int u(Call& call) { return push_matrix(call.L, MatX(column(pencil_of(call).pencil.form.u))); }
int S(Call& call) { return push_rational(call, regular(call, "Weierstrass form").S); }
int T(Call& call) { return push_rational(call, regular(call, "Weierstrass form").T); }
int J(Call& call) { return push_rational(call, regular(call, "Weierstrass form").J); }
int N(Call& call) { return push_rational(call, regular(call, "Weierstrass form").N); }
int basis(Call& call) { return push_rational(call, regular(call, "consistent space").basis()); }

int modes(Call& call) {
  const auto& list = regular(call, "modes").modes;
  lua_State* L = call.L;
  lua_createtable(L, static_cast<int>(list.size()), 0);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const dae::Mode& m = list[i];
    lua_createtable(L, 0, 4);
    if (m.exact) {
      push_expr(L, m.exact->first);
      lua_setfield(L, -2, "re");
      push_expr(L, m.exact->second);
      lua_setfield(L, -2, "im");
    } else {
      lua_pushnumber(L, m.value.real());
      lua_setfield(L, -2, "re");
      lua_pushnumber(L, m.value.imag());
      lua_setfield(L, -2, "im");
    }
    lua_pushinteger(L, m.multiplicity);
    lua_setfield(L, -2, "multiplicity");
    lua_pushboolean(L, m.exact.has_value());
    lua_setfield(L, -2, "exact");
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  return 1;
}

int push_constraints(Call& call, const std::vector<dae::Constraint>& list) {
  auto value = std::make_shared<Constraints>();
  value->list = list;
  return call.push(std::shared_ptr<const Constraints>(value));
}
int pencil_constraints(Call& call) {
  return push_constraints(call, regular(call, "constraints").constraints);
}
int pencil_algebraic(Call& call) { return push_constraints(call, regular(call, "constraints").algebraic); }

int shuffle(Call& call) {
  regular(call, "shuffle");
  collect_aliases(call.L);
  const ModelPencil& p = pencil_of(call);
  // first order: x″ = f is shown as x′ = v, v′ = f
  const dae::ModelPtr lowered = dae::to_first_order(p.model);
  const auto form = dae::linear_form(*lowered);
  PENDULA_ASSERT(form.has_value(), "a linear model is not linear with its derivatives as variables");
  return call.push(dae::describe(dae::shuffle(*form, dae::ShuffleScope::derivation), *form));
}

Expr constant_entry(Expr e, const std::string& what) {
  for (Expr leaf : leaves({&e, 1}))
    if (is_varying(leaf))
      throw Error(text(what, " must not depend on ", to_text(leaf), ", got ", to_text(e)));
  return e;
}

/// A column with a value for every state, or { x = 1, [y] = alpha }.
void read_x0(Call& call, const ModelPencil& p, dae::SolutionRequest& request) {
  lua_State* L = call.L;
  const bool keyed = lua_istable(L, 2) && lua_rawlen(L, 2) == 0;
  if (!keyed) {
    const VecX values = to_column(L, 2, "x0");
    const auto& states = p.pencil.form.x;
    if (values.size() != static_cast<Eigen::Index>(states.size()))
      throw Error(text("x0 has ", values.size(), values.size() == 1 ? " entry" : " entries", " for ",
                       states.size(), " unknowns; a table { ", to_text(states[0]),
                       " = 1 } gives only some of them"));
    for (std::size_t i = 0; i < states.size(); ++i)
      request.x0.emplace_back(states[i], constant_entry(values[i], "x0"));
    return;
  }
  const auto known = known_leaves(*p.model);
  each_symbol_entry(L, 2, "x0", known, [&](const SymbolEntry& entry) {
    const std::string what = "x0." + entry.key();
    const VecX values = entry.leaves.size() == 1 && is_expression(L, entry.value)
                            ? VecX(VecX::Constant(1, to_expr(L, entry.value, what)))
                            : to_column(L, entry.value, what);
    if (values.size() != static_cast<Eigen::Index>(entry.leaves.size()))
      throw Error(
          text(what, " has ", values.size(), " entries, '", entry.key(), "' has ", entry.leaves.size()));
    for (std::size_t i = 0; i < entry.leaves.size(); ++i)
      request.x0.emplace_back(entry.leaves[i], constant_entry(values[i], what));
  });
}

const OptionTable solution_options = {
    {"inputs", "table", "", "expressions in t: { u = sin(t) }", "@inputs"},
    {"from", "number", "0", "the time of x0, a rational number, in s"},
};

int solution(Call& call) {
  const ModelPencil& p = pencil_of(call);
  dae::SolutionRequest request;
  request.general = !call.has(2);
  if (call.has(3)) {
    const Options o = call.options(3);
    const Inputs inputs = read_inputs(o, *p.model, call.L);
    if (!inputs.numeric.empty())
      throw Error(text("input '", to_text(inputs.numeric[0].leaf),
                       "' must be an expression in t here; use sys:integrate{ … } for functions and data"));
    request.inputs = inputs.expressions;
    if (o.has("from")) {
      const Expr from = to_expr(call.L, o.push("from"), "from");
      lua_pop(call.L, 1);
      const mpq_class* q = exact_value(from);
      if (!q) throw Error(text("from must be a rational number, got ", to_text(from)));
      request.from = *q;
    }
  }
  if (!request.general) read_x0(call, p, request);
  return push_matrix(call.L, MatX(dae::solution(p.pencil, request)));
}

int to_string(Call& call) {
  collect_aliases(call.L);
  const ModelPencil& p = any_pencil(call);
  return call.push(p.det ? symbolic_text(p) : dae::describe(p.pencil));
}

}  // namespace

extern const Module pencil_module = {
    "pencil",
    "Linear systems with constant coefficients, exactly",
    {
        {"model:pencil", make_pencil, "sys:pencil() -> pencil",
         R"(E x′ = A x + B u + f(t) over the rational numbers: det(sE - A), modes, index, Weierstrass form,
            constraints and solutions. Parameters have their values; an equation that is not linear is
            named. With parameters without value: det(sE - A), index and free initial values as they are for
            almost all values, and for which values they differ.)",
         "x = var(\"x\", 3)  p = dae{ mat{{1,1,0},{0,0,1},{1,1,1}} * der(x) ~ x "
         "}:pencil()  return p.index, p.dof, p.det",
         "2 1 2 s - 1"},
        {"model:characteristic", characteristic, "sys:characteristic() -> expression, list",
         R"(det(sE - A) up to its sign for a linear model with parameters as symbols, and its coefficients from
            s⁰ on. Its degree is the number of free initial values where the last coefficient is not 0; where
            that is 0, the degree, the index and the values that may be fixed differ.)",
         "x, y = vars \"x y\"  a, e = params \"a e\"  p, c = dae{ der(x) ~ y, e*der(y) ~ -x - a*y }:"
         "characteristic()  return #c - 1, c[2]",
         "2 a"},
        {"pencil#regular", is_regular, "p.regular -> boolean", "det(sE - A) is not identically zero.", "",
         ""},
        {"pencil#rank", rank, "p.rank -> integer", "The rank of sE - A at almost every s.", "", ""},
        {"pencil#det", det, "p.det -> expression", "det(sE - A), a polynomial in the parameter s.", "", ""},
        {"pencil#dof", pencil_dof, "p.dof -> integer",
         "The number of free initial values: the degree of p.det.", "", ""},
        {"pencil#degree", pencil_dof, "p.degree -> integer", "The degree of p.det.", "", ""},
        {"pencil#index", pencil_index, "p.index -> integer",
         "The nilpotency index of N: the differentiation index of the system.", "", ""},
        {"pencil#modes", modes, "p.modes -> list of { re =, im =, multiplicity =, exact = }",
         "The zeros of p.det: exact where they are rational or quadratic, else decimals.",
         R"(x = var "x"  m = dae{ der(x, 2) + x ~ 0 }:pencil().modes  return m[2].re, m[2].im)", "0 1"},
        {"pencil#x", x, "p.x -> column", "The unknowns in the order of the columns of E.", "", ""},
        {"pencil#u", u, "p.u -> column", "The inputs in the order of the columns of B.", "", ""},
        {"pencil#E", E, "p.E -> matrix", "E of E x′ = A x + B u + f.", "", ""},
        {"pencil#A", A, "p.A -> matrix", "A of E x′ = A x + B u + f.", "", ""},
        {"pencil#B", B, "p.B -> matrix", "B of E x′ = A x + B u + f.", "", ""},
        {"pencil#f", f, "p.f -> column", "f of E x′ = A x + B u + f.", "", ""},
        {"pencil#S", S, "p.S -> matrix", "S E T = diag(I, N), S A T = diag(J, I).",
         "x = var(\"x\", 3)  p = dae{ mat{{1,1,0},{0,0,1},{1,1,1}} * der(x) ~ x }:pencil()  return p.S * "
         "p.E * p.T == blkdiag(eye(1), p.N)",
         "true"},
        {"pencil#T", T, "p.T -> matrix", "x = T (x₁, x₂); its first p.dof columns span the consistent x(0).",
         "", ""},
        {"pencil#J", J, "p.J -> matrix", "x₁′ = J x₁ + …; Jordan blocks where eigenvalues are rational.", "",
         ""},
        {"pencil#N", N, "p.N -> matrix", "N x₂′ = x₂ + …, nilpotent, in Jordan form.", "", ""},
        {"pencil#basis", basis, "p.basis -> matrix", "Columns that span the consistent x(0) without inputs.",
         "", ""},
        {"pencil#constraints", pencil_constraints, "p.constraints -> constraints",
         "The conditions on a start, explicit and hidden, in the states.",
         "x = var(\"x\", 3)  return dae{ mat{{1,1,0},{0,0,1},{1,1,1}} * der(x) ~ x }:pencil().constraints[2]",
         "0 = x₁ - x₂"},
        {"pencil#algebraic", pencil_algebraic, "p.algebraic -> constraints",
         "The conditions from which the algebraic variables follow.", "", ""},
        {"pencil:solution", solution, "p:solution([x0 [, { inputs =, from = 0 }]]) -> column",
         R"(x(t) as expressions in t. x0 is a column or a table with as many values as are free; without it
            the solution has constants c1, c2 …. Exact where the modes are rational or quadratic, else
            decimals.)",
         "x = var(\"x\", 3)  p = dae{ mat{{1,1,0},{0,0,1},{1,1,1}} * der(x) ~ x "
         "}:pencil()  return p:solution{ x1 = 1 }[3]",
         "2 exp(t/2)", &solution_options},
        {"pencil:shuffle", shuffle, "p:shuffle() -> string",
         "The reduction to a semi-explicit form by combining and differentiating equations, step by step.",
         R"(
             x = var("x", 2)
             dae{ der(x[1]) ~ x[2], 0 ~ x[1] - sin(t) }:pencil():shuffle())",
         R"(
               (a)  x₁′ = x₂
               (b)  0 = x₁ - sin(t)
             E has rank 1 of 2
               (b) has no derivative:  0 = x₁ - sin(t)
               differentiate (b):      x₁′ = cos(t)     (c)
             E has rank 1 of 2
               (c) - (a):          0 = x₂ - cos(t)  the new (c)
               differentiate (c):  x₂′ = -sin(t)    (d)
             E has rank 2 of 2: regular after 2 shuffles, so the index is 2
             Semi-explicit form:
               0 = x₁ - sin(t)
               0 = x₂ - cos(t))"},
        {"pencil:__tostring", to_string, "print(p)",
         "Determinant, modes, constraints, consistent starts and the Weierstrass form.", "", ""},
    }};

}  // namespace pendula::lua
