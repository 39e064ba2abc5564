// The `linear algebra` module: exact for rational or symbolic matrices, in doubles for matrices of data.
#include <cmath>

#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "lti/exponential.hpp"
#include "lua/bind/expr/expr.hpp"
#include "lua/bind/expr/matrix_algebra.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

namespace {

/// A square argument: doubles if it holds data, else expressions.
Value square_matrix(Call& call, int i) {
  Value a = to_value(call.L, i, "A");
  if (const Expr* e = std::get_if<Expr>(&a)) a = MatX(MatX::Constant(1, 1, *e));
  if (const double* d = std::get_if<double>(&a)) a = Mat(Mat::Constant(1, 1, *d));
  const bool square = std::visit(
      [](const auto& m) {
        if constexpr (requires { m.rows(); })
          return m.rows() == m.cols();
        else
          return true;
      },
      a);
  if (!square)
    throw Error(text("the matrix must be square, not a ", shape(a),
                     call.count() > 1 ? "; least squares are lsq(A, b)" : ""));
  return a;
}

/// An exact matrix of constants that are not all rational (√2, 2.718…) in doubles; empty if it
/// contains a symbol.
std::optional<Mat> in_doubles(const MatX& a) {
  Mat values(a.rows(), a.cols());
  for (Eigen::Index k = 0; k < a.size(); ++k) {
    const auto value = number_value(a.data()[k]);
    if (!value) return {};
    values.data()[k] = *value;
  }
  return values;
}

/// The matrix in doubles if it contains measured numbers (lti::field), for which exact polynomials
/// would take minutes without benefit. Not for small matrices: exact results are cheap there, and
/// 10⁻³⁰⁰ is an ordinary number.
std::optional<Mat> measured(const MatX& a) {
  constexpr Eigen::Index small = 6;
  return a.rows() > small && lti::field(a) == lti::Field::numeric ? in_doubles(a) : std::nullopt;
}

MatX simplified(const MatX& a) {
  constexpr Eigen::Index readable =
      100;  // larger results are sequences of eliminations and not meant to be read
  return a.size() > readable ? a : MatX(a.unaryExpr([](Expr e) { return simplify(e); }));
}

void check_cost(const MatX& a) {
  const Eigen::Index most = linalg::is_rational(a) ? 400 : 200;
  if (a.rows() > most)
    throw Error(text("an exact calculation with ", a.rows(), " rows is too large (at most ", most,
                     "); evaluate(A) makes it a matrix of doubles"));
}

double finite(double v, const char* what) {
  if (!std::isfinite(v))
    throw Error(text(what, " overflows double precision: divide A by a number of its size first"));
  return v;
}

int det(Call& call) {
  const Value a = square_matrix(call, 1);
  if (const Mat* m = std::get_if<Mat>(&a))
    return call.push(finite(linalg::determinant(*m), "the determinant"));
  const MatX& e = std::get<MatX>(a);
  constexpr Eigen::Index readable = 20;  // an exact fraction of more measured numbers is unreadable
  if (const auto values = e.rows() > readable ? measured(e) : std::nullopt)
    return call.push(finite(linalg::determinant(*values), "the determinant"));
  check_cost(e);
  const Expr d = linalg::determinant(e);
  return push_expr(call.L, e.rows() <= 6 ? simplify(d) : d);
}

int inv(Call& call) {
  const Value a = square_matrix(call, 1);
  if (const Mat* m = std::get_if<Mat>(&a)) return push_value(call.L, linalg::inverse(*m));
  check_cost(std::get<MatX>(a));
  return push_value(call.L, simplified(linalg::inverse(std::get<MatX>(a))));
}

/// The expression at the key i of the table at an index of the stack, if there is one.
std::optional<Expr> entry(Call& call, int index, lua_Integer i) {
  std::optional<Expr> e;
  lua_geti(call.L, index, i);
  if (const auto* held = object_at(call.L, lua_gettop(call.L), TypeName<Expr>::value))
    e = *static_cast<const Expr*>(held->get());
  lua_pop(call.L, 1);
  return e;
}

/// Is the first argument an equation or a list of equations, or an expression (or list of them) that contains
/// the symbol (the first symbol of the list) given second?
bool asks_for_equations(Call& call) {
  if (call.is<Equation>(1)) return true;
  std::vector<Expr> e;
  if (lua_istable(call.L, 1)) {
    lua_geti(call.L, 1, 1);
    const bool equation = object_type(call.L, -1) == TypeName<Equation>::value;
    lua_pop(call.L, 1);
    if (equation) return true;
    for (lua_Integer i = 1; const auto each = entry(call, 1, i); ++i) e.push_back(*each);
  } else if (call.is<Expr>(1)) {
    e.push_back(call.object<Expr>(1, "A"));
    if (!call.has(2)) return true;
  }
  if (e.empty()) return false;
  std::optional<Expr> x;
  if (call.is<Expr>(2)) x = call.object<Expr>(2, "b");
  if (lua_istable(call.L, 2)) x = entry(call, 2, 1);
  const auto in = leaves(e);
  return x && x->is_symbol() && std::find(in.begin(), in.end(), *x) != in.end();
}

/// Calls stdlib/algebra/solve.lua, which solves equations in closed form; errors carry the name solve.
int solve_equations(Call& call) {
  lua_State* L = call.L;
  lua_settop(L, 2);
  push_stdlib_environment(L);
  lua_getfield(L, -1, "include");
  lua_pushliteral(L, "algebra/solve");
  protected_call(L, 1, 1);
  lua_getfield(L, -1, "solve_equations");
  lua_pushvalue(L, 1);
  lua_pushvalue(L, 2);
  lua_pushliteral(L, "solve");
  protected_call(L, 3, 1);
  return 1;
}

int solve(Call& call) {
  if (asks_for_equations(call)) return solve_equations(call);
  const Value a = square_matrix(call, 1);
  Value b = to_value(call.L, 2, "b");
  const bool data = std::holds_alternative<Mat>(a) || std::holds_alternative<Mat>(b);
  const MatX right = data && std::holds_alternative<Mat>(b) ? MatX() : to_matrix(call.L, 2, "b");
  if (data) {
    const auto x = std::holds_alternative<Mat>(a) ? std::get<Mat>(a) : in_doubles(std::get<MatX>(a));
    const auto y = std::holds_alternative<Mat>(b) ? std::get<Mat>(b) : in_doubles(right);
    if (x && y) return push_value(call.L, linalg::solve(*x, *y));
  }
  const MatX exact_a = to_matrix(call.L, 1, "A"), exact_b = to_matrix(call.L, 2, "b");
  check_cost(exact_a);
  return push_value(call.L, simplified(linalg::solve(exact_a, exact_b)));
}

int rank(Call& call) {
  const Value a = to_value(call.L, 1, "A");
  if (const Mat* m = std::get_if<Mat>(&a)) return call.push(linalg::rank(*m));
  const MatX e = to_matrix(call.L, 1, "A");
  check_cost(e);
  return call.push(linalg::rank(e));
}

int charpoly(Call& call) {
  const Value given = square_matrix(call, 1);
  const auto* a = std::get_if<MatX>(&given);
  const std::optional<Mat> values = a ? measured(*a) : std::get<Mat>(given);
  if (!values) check_cost(*a);
  const Vec numbers = values ? linalg::characteristic(*values) : Vec();
  for (const double v : numbers) finite(v, "a coefficient");
  if (values && !call.has(2)) return push_matrix(call.L, Mat(numbers));
  const VecX c = values ? VecX(lti::expressions(Mat(numbers))) : linalg::characteristic(*a);
  if (!call.has(2)) return push_matrix(call.L, MatX(c));
  const Expr s = to_expr(call.L, 2, "s");
  Expr p = 0;
  for (Eigen::Index k = 0; k < c.size(); ++k) p += c[k] * pow(s, Expr(static_cast<long>(c.size() - 1 - k)));
  return push_expr(call.L, p);
}

int expm(Call& call) {
  const Value a = square_matrix(call, 1);
  if (const Mat* m = std::get_if<Mat>(&a)) return push_value(call.L, linalg::exponential(*m));
  const MatX& e = std::get<MatX>(a);
  if (e.rows() == 0) return push_matrix(call.L, e);
  if (const auto values = measured(e)) return push_value(call.L, linalg::exponential(*values));
  check_cost(e);
  if (auto exact = linalg::exact_exponential(e)) return push_value(call.L, *exact);
  if (!in_doubles(e))
    if (auto exact = lti::exponential(e)) return push_value(call.L, *exact);
  if (const auto values = in_doubles(e)) return push_value(call.L, linalg::exponential(*values));
  throw Error(
      "this exponential has no exact form here: it needs a nilpotent "
      "matrix or A*t with rational eigenvalues; "
      "for numbers write expm(evaluate(A, {…}))");
}

// ── eigenvalues ──

int eig(Call& call) {
  if (object_type(call.L, 1) == "lti") throw Error("the poles of a linear system are G:poles(), or eig(G.A)");
  if (object_type(call.L, 1) == "model")
    throw Error("the eigenvalues of a model are those of sys:linearize(at): eig(sys:linearize(at).A)");
  const Value a = square_matrix(call, 1);
  auto result = std::make_shared<Eigenvalues>();
  if (const Mat* m = std::get_if<Mat>(&a)) {
    result->numeric = linalg::eigensystem(*m);
  } else {
    const MatX& e = std::get<MatX>(a);
    const bool data = measured(e).has_value();
    if (!data) check_cost(e);
    const auto values = in_doubles(e);
    if (!values)
      throw Error("eigenvalues need numbers; charpoly(A, s) is symbolic, evaluate(A, {…}) gives numbers");
    result->numeric = linalg::eigensystem(*values);
    constexpr Eigen::Index most = 30;
    if (linalg::is_rational(e) && !data && e.rows() > 0 && e.rows() <= most)
      result->exact = linalg::exact_eigenvalues(e);
  }
  if (result->exact) {  // decimals of the exact values, in which repeated eigenvalues agree
    for (std::size_t k = 0; k < result->exact->size(); ++k) {
      result->numeric.re[k] = *number_value((*result->exact)[k].re);
      result->numeric.im[k] = *number_value((*result->exact)[k].im);
    }
  }
  return call.push(std::shared_ptr<const Eigenvalues>(std::move(result)));
}

int push_part(Call& call, bool imaginary) {
  const auto& e = call.object<Eigenvalues>(1, "eigenvalues");
  if (!e.exact) return push_matrix(call.L, Mat(imaginary ? e.numeric.im : e.numeric.re));
  MatX part(static_cast<Eigen::Index>(e.exact->size()), 1);
  for (std::size_t k = 0; k < e.exact->size(); ++k)
    part(static_cast<Eigen::Index>(k), 0) = imaginary ? (*e.exact)[k].im : (*e.exact)[k].re;
  return push_matrix(call.L, part);
}
int real_parts(Call& call) { return push_part(call, false); }
int imaginary_parts(Call& call) { return push_part(call, true); }

int values(Call& call) {
  if (!call.object<Eigenvalues>(1, "eigenvalues").real())
    throw Error("some eigenvalues are complex: read .re and .im");
  return push_part(call, false);
}

int vectors(Call& call) {
  const auto& e = call.object<Eigenvalues>(1, "eigenvalues");
  if (!e.real()) throw Error("some eigenvectors are complex: read .vectors_re and .vectors_im");
  return push_matrix(call.L, e.numeric.vectors_re);
}
int vectors_re(Call& call) {
  return push_matrix(call.L, call.object<Eigenvalues>(1, "eigenvalues").numeric.vectors_re);
}
int vectors_im(Call& call) {
  return push_matrix(call.L, call.object<Eigenvalues>(1, "eigenvalues").numeric.vectors_im);
}
int count_of(Call& call) {
  return call.push(static_cast<long>(call.object<Eigenvalues>(1, "eigenvalues").numeric.re.size()));
}

int eigenvalues_to_string(Call& call) {
  const auto& e = call.object<Eigenvalues>(1, "eigenvalues");
  std::vector<std::string> list;
  for (Eigen::Index k = 0; k < e.numeric.re.size(); ++k) {
    const double re = e.numeric.re[k], im = e.numeric.im[k];
    const auto size = static_cast<std::size_t>(k);
    const std::string a = e.exact ? to_text((*e.exact)[size].re) : rounded(re);
    const Expr b = e.exact ? (*e.exact)[size].im : Expr(0);
    std::string s = re == 0 && im != 0 ? "" : a;
    if (im != 0) {
      const Expr size_of_b = im < 0 ? -b : b;
      const std::string shown_im = e.exact ? to_text(size_of_b) : rounded(std::fabs(im));
      s += s.empty() ? (im < 0 ? "-" : "") : (im < 0 ? " - " : " + ");
      s += shown_im == "1" ? "i" : shown_im + " i";
    }
    list.push_back(s);
  }
  return call.push("eigenvalues: " + join(list, ", "));
}

}  // namespace

extern const Module algebra_module = {
    "linear algebra",
    "Linear algebra, exact where the matrix is",
    {
        {"det", det, "det(A) -> scalar", "The determinant; exact for rational and symbolic matrices.",
         "det{{1, 2}, {3, 4}}", "-2"},
        {"inv", inv, "inv(A) -> matrix",
         "The inverse. A singular matrix is an error that shows a null vector.", "inv{{2, 0}, {0, 4}}(2, 2)",
         "1/4"},
        {"rank", rank, "rank(A) -> integer",
         R"(The rank: exact for rational matrices, at almost all values of the symbols for symbolic ones,
            by singular values for data.)",
         "rank{{1, 2}, {2, 4}}", "1"},
        {"solve", solve, "solve(A, b) -> x, or solve(equations, unknowns) -> solutions",
         R"(The solution of A x = b for a column or
            several. Of equations, solve(x^2 ~ 2, x) or solve({ x + y ~ 3, x*y ~ 2 }, { x, y }): all solutions in
            closed form (roots, solve_equations).)",
         "solve({{2, 0}, {0, 4}}, {1, 1})[2]", "1/4"},
        {"charpoly", charpoly, "charpoly(A [, s]) -> column or polynomial",
         "The coefficients 1, c₁, …, cₙ of det(sI - A), or the polynomial in s.",
         "charpoly({{1, 2}, {3, 4}})[3]", "-2"},
        {"eig", eig, "eig(A) -> eigenvalues",
         "Eigenvalues with .values (or .re, .im) and .vectors; exact where all but two are rational.",
         "eig{{2, 1}, {1, 2}}", "eigenvalues: 1, 3"},
        {"expm", expm, "expm(A) -> matrix",
         "The matrix exponential; exact for nilpotent matrices and for A*t with rational eigenvalues.",
         "expm{{0, 1}, {0, 0}}(1, 2)", "1"},
        {"eigenvalues#re", real_parts, "eig(A).re", "The real parts."},
        {"eigenvalues#im", imaginary_parts, "eig(A).im", "The imaginary parts."},
        {"eigenvalues#values", values, "eig(A).values", "The eigenvalues, if all are real."},
        {"eigenvalues#vectors", vectors, "eig(A).vectors",
         "Eigenvectors as columns of length 1, if all eigenvalues are real."},
        {"eigenvalues#vectors_re", vectors_re, "eig(A).vectors_re", "The real parts of the eigenvectors."},
        {"eigenvalues#vectors_im", vectors_im, "eig(A).vectors_im",
         "The imaginary parts of the eigenvectors."},
        {"eigenvalues:__len", count_of, "#eig(A)", "How many there are."},
        {"eigenvalues:__tostring", eigenvalues_to_string, "tostring(eig(A))",
         "The list, a ± b i where complex."},
    }};

}  // namespace pendula::lua
