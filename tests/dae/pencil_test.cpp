// Linear systems exactly: the exam, the lecture, textbook cases, and random
// Weierstrass forms whose answer is known.
#include "dae/pencil/pencil.hpp"

#include <doctest/doctest.h>

#include <random>

#include "base/error.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/make_model.hpp"
#include "dae/pencil/pencil_shuffle.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"
#include "tests/error_text.hpp"

namespace pendula::pencil_test {

using dae::RationalMatrix;

namespace {

Expr variable(const char* name) { return symbol(Kind::variable, name); }
Expr input(const char* name) { return symbol(Kind::input, name); }
Expr dot(Expr x, int k = 1) { return derivative_leaf(x, k); }

dae::ModelPtr model(std::vector<std::pair<Expr, Expr>> equations) {
  std::vector<dae::Block> blocks;
  for (auto [l, r] : equations) blocks.push_back({VecX::Constant(1, l), VecX::Constant(1, r), ""});
  return dae::make_model(std::move(blocks));
}

RationalMatrix matrix(int rows, int cols, std::vector<mpq_class> entries) {
  RationalMatrix m(rows, cols);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j) m(i, j) = entries[i * cols + j];
  return m;
}

dae::ModelPtr linear(const RationalMatrix& E, const RationalMatrix& A, const MatX& B = {}) {
  return dae::linear(dae::expressions(E), dae::expressions(A), B, {}, {});
}

std::vector<std::string> texts(const std::vector<dae::Constraint>& list) {
  std::vector<std::string> lines;
  for (const auto& c : list) lines.push_back(to_text(c.residual));
  return lines;
}

/// E x′ - A x - g for a solution x(t), at a random time.
bool solves(const dae::Pencil& p, const VecX& x, const VecX& g) {
  VecX v = x.unaryExpr([](Expr e) { return total_derivative(e); });
  const VecX residual = dae::product(p.form.E, v) - dae::product(p.form.A, x) - g;
  return std::all_of(residual.data(), residual.data() + residual.size(),
                     [](Expr e) { return generic::is_zero(e); });
}

const RationalMatrix exam_E = matrix(3, 3, {1, 1, 0, 0, 0, 1, 1, 1, 1});

}  // namespace

TEST_CASE("exam 3(d): index 2, one free value, mode 1/2, x = α e^{t/2} (1, 1, 2)") {
  const auto m = linear(exam_E, RationalMatrix::identity(3));
  const auto p = dae::pencil(*m);
  CHECK(p.regular);
  CHECK(p.index == 2);
  CHECK(p.dof == 1);
  CHECK(p.det == dae::Polynomial{-1, 2});
  REQUIRE(p.modes.size() == 1);
  CHECK(p.modes[0].exact->first == Expr(mpq_class(1, 2)));
  CHECK(p.basis() == matrix(3, 1, {1, 1, 2}));
  CHECK(p.J(0, 0) == mpq_class(1, 2));
  CHECK(texts(p.constraints) == std::vector<std::string>{"x₁ + x₂ - x₃", "x₁ - x₂"});
  CHECK(p.constraints[1].derivative == 1);
  CHECK(p.algebraic.empty());

  const Expr alpha = symbol(Kind::parameter, "alpha");
  const VecX x = dae::solution(p, {.x0 = {{p.form.x[0], alpha}}, .inputs = {}});
  const Expr expected = alpha * exp(time_symbol() / 2);
  CHECK(generic::is_zero(x[0] - expected));
  CHECK(generic::is_zero(x[1] - expected));
  CHECK(generic::is_zero(x[2] - 2 * expected));
}

TEST_CASE("exam 3(d): the shuffle prints the exam's derivation") {
  const auto form = *dae::linear_form(*linear(exam_E, RationalMatrix::identity(3)));
  CHECK(dae::describe(dae::shuffle(form, dae::ShuffleScope::derivation), form) ==
        "  (a)  x₁′ + x₂′ = x₁\n"
        "  (b)  x₃′ = x₂\n"
        "  (c)  x₁′ + x₂′ + x₃′ = x₃\n"
        "E has rank 2 of 3\n"
        "  (c) - (a) - (b):    0 = x₁ + x₂ - x₃     the new (c)\n"
        "  differentiate (c):  x₁′ + x₂′ - x₃′ = 0  (d)\n"
        "E has rank 2 of 3\n"
        "  (d) - (a) + (b):    0 = x₁ - x₂    the new (d)\n"
        "  differentiate (d):  x₁′ - x₂′ = 0  (e)\n"
        "E has rank 3 of 3: regular after 2 shuffles, so the index is 2\n"
        "  (e) + (a):  2 x₁′ = x₁\n"
        "Semi-explicit form:\n"
        "  x₁′ = x₁/2\n"
        "  0 = x₁ + x₂ - x₃\n"
        "  0 = x₁ - x₂");
}

TEST_CASE("lecture: E x′ = x + B u with nilpotent E has index 3 and x = (-u″, -u′, -u)") {
  MatX B = MatX::Zero(3, 1);
  B(2, 0) = 1;
  const auto p =
      dae::pencil(*linear(matrix(3, 3, {0, 1, 0, 0, 0, 1, 0, 0, 0}), RationalMatrix::identity(3), B));
  CHECK(p.index == 3);
  CHECK(p.dof == 0);
  CHECK(p.modes.empty());
  CHECK(p.S == RationalMatrix::identity(3));
  CHECK(p.T == RationalMatrix::identity(3));
  CHECK(p.constraints.size() == 2);
  CHECK(p.algebraic.size() == 1);
  const VecX x = dae::solution(p, {.x0 = {}, .inputs = {}});
  const Expr u = p.form.u[0];
  CHECK(x[0] == -dot(u, 2));
  CHECK(x[1] == -dot(u));
  CHECK(x[2] == -u);
}

TEST_CASE("a system whose structural index exceeds the true one: index 1, two free values (Reißig)") {
  const auto x = newly_declared(symbol_vector(Kind::variable, "x", 5));
  const auto p = dae::pencil(*model({{dot(x[1]) + dot(x[2]) + x[0], input("f1")},
                                     {dot(x[1]) + dot(x[2]) + x[1], input("f2")},
                                     {dot(x[3]) + dot(x[4]) + x[2], input("f3")},
                                     {dot(x[3]) + dot(x[4]) + x[3], input("f4")},
                                     {x[4], input("f5")}}));
  CHECK(p.index == 1);
  CHECK(p.dof == 2);
  CHECK(p.det == dae::Polynomial{1, 2, 1});
  CHECK(texts(p.constraints) == std::vector<std::string>{"x₃ - x₄ - f₃ + f₄", "x₅ - f₅"});
  CHECK(p.algebraic.size() == 1);
}

TEST_CASE("-x″ - y = sin t, x″ + x + y = t: index 3 and x = t + sin t, y = 0") {
  const Expr x = variable("x"), y = variable("y"), t = time_symbol();
  const auto p = dae::pencil(*model({{-dot(x, 2) - y, sin(t)}, {dot(x, 2) + x + y, t}}));
  CHECK(p.index == 3);
  CHECK(p.dof == 0);
  CHECK(p.form.x == std::vector<Expr>{x, y, dot(x)});
  const VecX s = dae::solution(p, {.x0 = {}, .inputs = {}});
  CHECK(generic::is_zero(s[0] - t - sin(t)));
  CHECK(s[1].is_zero());
}

TEST_CASE("circuits and oscillators: index 0 and 1, inputs, resonance, irrational rates") {
  const Expr x = variable("x"), i = variable("i"), u = input("u"), t = time_symbol();
  const Expr R = symbol(Kind::parameter, "R"), C = symbol(Kind::parameter, "C");
  const auto rc = dae::with_values(model({{C * dot(x), i}, {0, R * i + x - u}}), {{R, 2}, {C, Expr(0.25)}});
  const auto p = dae::pencil(*rc);
  CHECK(p.index == 1);
  CHECK(p.dof == 1);
  CHECK(p.modes[0].exact->first == Expr(-2));
  CHECK(p.form.used.size() == 2);
  for (Expr given : {Expr(1), t * t, exp(-2 * t), sin(3 * t) * exp(-t), cos(pi() * t), sin(sqrt(Expr(2)) * t),
                     exp(R * t)}) {
    CAPTURE(to_text(given));
    const VecX s = dae::solution(p, {.x0 = {{x, 5}}, .inputs = {{u, given}}});
    VecX g = p.form.forcing();
    for (Eigen::Index k = 0; k < 2; ++k) g[k] = substitute(g[k], {{u, substitute(given, {{R, 2}})}});
    CHECK(solves(p, s, g));
    CHECK(generic::is_zero(substitute(s[0], {{t, 0}}) - 5));
  }
  const auto resonant = dae::pencil(*model({{dot(x, 2) + x, sin(t)}}));
  const VecX s = dae::solution(resonant, {.x0 = {{x, 0}, {dot(x), 0}}, .inputs = {}});
  CHECK(generic::is_zero(s[0] - (sin(t) - t * cos(t)) / 2));
  const VecX later = dae::solution(resonant, {.x0 = {{x, 0}, {dot(x), 0}}, .inputs = {}, .from = 1});
  CHECK(generic::is_zero(substitute(later[0], {{t, 1}})));
  CHECK(solves(resonant, later, resonant.form.forcing()));
}

TEST_CASE("modes that are no quadratic surds are decimals, double ones too") {
  const Expr x = variable("x"), t = time_symbol();
  // (s³ - s - 1)²
  Expr left = dot(x, 6) - 2 * dot(x, 4) - 2 * dot(x, 3) + dot(x, 2) + 2 * dot(x) + x;
  const auto p = dae::pencil(*model({{left, 0}}));
  REQUIRE(p.modes.size() == 3);
  CHECK(p.modes[2].multiplicity == 2);
  CHECK(p.modes[2].value.real() == doctest::Approx(1.324717957244746).epsilon(1e-14));
  CHECK(!p.modes[2].exact);
  dae::SolutionRequest request;
  for (int k = 0; k < 6; ++k) request.x0.push_back({p.form.x[k], k == 2 ? 1 : 0});
  const VecX s = dae::solution(p, request);
  const Expr derivative = total_derivative(s[5]);
  std::vector<Expr> check{derivative - 2 * s[4] - 2 * s[3] + s[2] + 2 * s[1] + s[0], s[2], s[0]};
  CHECK(std::abs(evaluate(check, {{t, 0.7}})[0]) < 1e-9);  // rounding of decimals of size 1
  CHECK(evaluate(check, {{t, 0}})[1] == doctest::Approx(1).epsilon(1e-9));
}

TEST_CASE("singular pencils name the combination of equations and the unknowns that stay open") {
  const Expr x = variable("x"), y = variable("y"), z = variable("z"), u = input("u");
  const auto p = dae::pencil(*model({{dot(x), y}, {dot(x), y + u}, {0, x + z}}));
  CHECK(!p.regular);
  CHECK(p.rank == 2);
  CHECK(dae::describe_singular(p) ==
        "  (2) - (1) reads 0 = u: a condition on the inputs, or a contradiction\n"
        "  x, y, z are not determined: with any function φ one may add (φ, φ′, -φ) to (x, y, z)");
  CHECK(!dae::linear_index(p.form).regular);
  const auto hidden = dae::pencil(*model({{x, sin(time_symbol())}, {dot(x), 0}, {y + z, 0}}));
  CHECK(!hidden.regular);
  CHECK(dae::describe_singular(hidden).starts_with("  (1)′ - (2) reads 0 = cos(t)"));
  const auto wide = dae::pencil(*model({{dot(x) + dot(y), z}, {0, x + y}}));
  CHECK(!wide.regular);
  CHECK(wide.rows.empty());
  CHECK(wide.columns.size() == 1);
  CHECK(test::error_text([&] { dae::solution(p, {}); }).starts_with("the pencil is singular"));
}

TEST_CASE("what is not linear with constant rational coefficients is named") {
  const Expr x = variable("x"), y = variable("y"), t = time_symbol(), k = symbol(Kind::parameter, "nov");
  const auto reason = [](const dae::ModelPtr& m) {
    std::string why;
    CHECK(!dae::linear_form(*m, &why));
    return why;
  };
  CHECK(reason(model({{dot(x), y * y}, {0, x + y}})) ==
        "equation (1) 'x′ = y²' is not linear: the term y² is not a constant times y; sys:linearize(at) "
        "makes a "
        "linear model at a point");
  CHECK(reason(model({{dot(x), y}, {0, x + t * y}})) ==
        "the coefficient -t of y in equation (2) '0 = x + t y' is not constant: it depends on t");
  CHECK(reason(model({{dot(x), pi() * x}})).find("is not a rational number") != std::string::npos);
  CHECK(reason(model({{dot(x), k * x}})).find("the parameter 'nov' in the term") == 0);
  const auto cancelled = dae::linear_form(*model({{dot(x), (x + 1) * (x + 1) - x * x}}));
  REQUIRE(cancelled);
  CHECK(cancelled->A(0, 0) == 2);
  CHECK(cancelled->f[0] == Expr(1));
  const auto p = dae::pencil(*model({{dot(x), y}, {0, x - y}}));
  CHECK(test::error_text([&] {
          dae::solution(p, {.x0 = {{x, 1}, {y, 2}}, .inputs = {}});
        }).starts_with("x0 is not consistent: 0 ≠ -1 = x - y follows from the constraints"));
  CHECK(test::error_text([&] {
          dae::solution(p, {});
        }).starts_with("x0 leaves 1 value free: give one of x, y"));
}

TEST_CASE("random Weierstrass forms under random transformations are recovered") {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const auto pick = [&](int low, int high) {
      return std::uniform_int_distribution<int>(low, high)(random);
    };
    const auto regular = [&](int n) {
      while (true) {
        RationalMatrix m(n, n);
        for (int i = 0; i < n; ++i)
          for (int j = 0; j < n; ++j) m(i, j) = mpq_class(pick(-3, 3), pick(1, 2));
        for (int i = 0; i < n; ++i)
          for (int j = 0; j < n; ++j) m(i, j).canonicalize();
        if (dae::rank(m) == n) return m;
      }
    };
    const int d = pick(0, 4), blocks = pick(d == 0, 2);
    RationalMatrix J(d, d), N;
    for (int i = 0; i < d; ++i)
      for (int j = 0; j < d; ++j) J(i, j) = pick(-2, 2);
    int index = 0;
    for (int b = 0; b < blocks; ++b) {
      const int size = pick(1, 4);
      RationalMatrix block(size, size);
      for (int i = 0; i + 1 < size; ++i) block(i, i + 1) = 1;
      N = dae::diagonal(N, block);
      index = std::max(index, size);
    }
    const int n = d + N.rows();
    const RationalMatrix S = regular(n), T = regular(n);
    const auto m = linear(S * dae::diagonal(RationalMatrix::identity(d), N) * T,
                          S * dae::diagonal(J, RationalMatrix::identity(N.rows())) * T);
    const auto p = dae::pencil(*m);  // S E T and S A T are compared exactly inside
    CHECK(p.regular);
    CHECK(p.index == index);
    CHECK(p.dof == d);
    CHECK(p.S * p.form.E * p.T == dae::diagonal(RationalMatrix::identity(d), p.N));
    CHECK(p.S * p.form.A * p.T == dae::diagonal(p.J, RationalMatrix::identity(n - d)));
    dae::Polynomial wanted = dae::characteristic(J), got = p.det;
    for (mpq_class& c : got) c /= p.det.back();
    CHECK(got == wanted);
    const auto low = dae::linear_index(p.form);
    CHECK(low.index == index);
    CHECK(low.dof == d);
    CHECK(static_cast<int>(low.constraints.size() + low.algebraic.size()) == n - d);
    const VecX x = dae::solution(p, {.x0 = {}, .inputs = {}, .from = 0, .general = true});
    const bool exact =
        std::all_of(p.modes.begin(), p.modes.end(), [](const auto& mode) { return mode.exact.has_value(); });
    if (exact) CHECK(solves(p, x, VecX::Zero(n)));
  }
}

}  // namespace pendula::pencil_test
