// The solve node: derivatives against central differences, kernels and modular values against evaluation.
#include <doctest/doctest.h>

#include <cmath>

#include "base/error.hpp"
#include "codegen/kernel/kernel.hpp"
#include "dae/rank/modular.hpp"
#include "dae/rank/rank.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/solve.hpp"
#include "expr/print/print.hpp"

namespace pendula::solve_test {

namespace {

struct System {
  Expr a = symbol(Kind::variable, "a"), b = symbol(Kind::variable, "b"), c = symbol(Kind::variable, "c");
  MatX A{3, 3};
  VecX r{3};
  System() {
    A << 2 + a * a, b, 1, -b, 3, sin(c), a, 1, 4 + c;
    r << a, b * c, 1 - a;
  }
  std::vector<Expr> leaves() const { return {a, b, c}; }
};

using Values = std::unordered_map<Expr, double>;

double value(Expr e, const Values& at) { return evaluate({&e, 1}, at)[0]; }

/// Central difference with h = 1e-5: error about h² + 1e-16/h ≈ 1e-10.
double difference(Expr e, Values at, Expr leaf) {
  const double h = 1e-5, x = at[leaf];
  at[leaf] = x + h;
  const double above = value(e, at);
  at[leaf] = x - h;
  return (above - value(e, at)) / (2 * h);
}

}  // namespace

TEST_CASE("solve node: A x = b holds, equal systems are one node, operands are A row by row, then b") {
  const System s;
  const VecX x = linear_solution(s.A, s.r);
  CHECK(x[0].op() == Op::solve);
  CHECK(bool(linear_solution(s.A, s.r) == x));
  CHECK(x[0].operands().size() == 12);
  CHECK(x[0].operand(1) == s.A(0, 1));
  CHECK(x[0].operand(11) == s.r[2]);
  CHECK(x[2].operands().size() == 1);
  const Values at{{s.a, .3}, {s.b, -.7}, {s.c, 1.1}};
  const VecX residual = s.A * x - s.r;
  for (Expr e : residual) CHECK(std::fabs(value(e, at)) < 1e-15);
}

TEST_CASE("solve node: what needs no elimination is divided out") {
  const Expr a = symbol(Kind::variable, "a"), b = symbol(Kind::variable, "b");
  MatX A(1, 1);
  VecX r(1);
  A << a;
  r << b;
  CHECK(linear_solution(A, r)[0] == b / a);
  MatX T(2, 2);
  VecX q(2);
  T << a, 1, 0, b;
  q << 1, a;
  const VecX x = linear_solution(T, q);
  CHECK(x[1] == a / b);
  CHECK(x[0] == (1 - a / b) / a);
  MatX N(2, 2);
  VecX n(2);
  N << 1, 2, 3, 4;
  n << 5, 6;
  CHECK(linear_solution(N, n)[0] == Expr(-4));
  const System s;
  CHECK(linear_solution(s.A, VecX::Zero(3))[1].is_zero());
  T << a, 1, 0, 0;
  CHECK_THROWS_WITH_AS(linear_solution(T, q),
                       "a linear system cannot be solved: row 2 of its matrix contains only zeros", Error);
}

TEST_CASE("solve node: forward and reverse derivatives agree with central differences, twice") {
  const System s;
  const VecX x = linear_solution(s.A, s.r);
  const Values at{{s.a, .3}, {s.b, -.7}, {s.c, 1.1}};
  const Expr f = x[0] * x[2] + exp(x[1]);
  const auto g = gradient(f, s.leaves());
  for (std::size_t j = 0; j < 3; ++j) {
    const Expr leaf = s.leaves()[j];
    CHECK(std::fabs(value(g[j], at) - difference(f, at, leaf)) < 1e-8);
    CHECK(std::fabs(value(partial(f, leaf), at) - value(g[j], at)) < 1e-14);
    for (Expr second : s.leaves())
      CHECK(std::fabs(value(partial(g[j], second), at) - difference(g[j], at, second)) < 1e-8);
  }
  const Expr rate = total_derivative(x[1]);
  const Values moving{{s.a, .3},
                      {s.b, -.7},
                      {s.c, 1.1},
                      {derivative_leaf(s.a), 2},
                      {derivative_leaf(s.b), -1},
                      {derivative_leaf(s.c), .5}};
  double chain = 0;
  for (Expr leaf : s.leaves()) chain += value(partial(x[1], leaf), at) * moving.at(derivative_leaf(leaf));
  CHECK(std::fabs(value(rate, moving) - chain) < 1e-14);
}

TEST_CASE("solve node: a kernel gives what evaluate gives; matrix and transpose share one factorisation") {
  const System s;
  const VecX x = linear_solution(s.A, s.r);
  std::vector<Expr> outputs(x.begin(), x.end());
  for (Expr e : gradient(x[0] + x[1], s.leaves())) outputs.push_back(e);
  outputs.push_back(partial(x[2], s.b));
  const codegen::Kernel kernel(outputs, s.leaves());
  const std::vector<double> in{.3, -.7, 1.1}, got = kernel(in);
  const auto wanted = evaluate(outputs, {{s.a, in[0]}, {s.b, in[1]}, {s.c, in[2]}});
  for (std::size_t i = 0; i < got.size(); ++i) CHECK(std::fabs(got[i] - wanted[i]) < 1e-14);
  const VecX y = linear_solution(s.A.transpose(), VecX::Constant(3, s.b));
  CHECK(system_of(y[0]).matrix == system_of(x[0]).matrix);
  CHECK(system_of(y[0]).transposed != system_of(x[0]).transposed);
}

TEST_CASE("solve node: partial pivoting where a diagonal entry vanishes, and no number where A is singular") {
  const Expr a = symbol(Kind::variable, "a"), b = symbol(Kind::variable, "b");
  MatX A(2, 2);
  VecX r(2);
  A << a, 1, 1, b;
  r << 3, 5;
  const VecX x = linear_solution(A, r);
  const std::vector<Expr> out{x[0], x[1]}, in{a, b};
  const codegen::Kernel kernel(out, in);
  CHECK(kernel(std::vector<double>{0, 0}) == std::vector<double>{5, 3});
  CHECK_FALSE(std::isfinite(kernel(std::vector<double>{1, 1})[0]));
  CHECK_FALSE(std::isfinite(value(x[0], {{a, 1}, {b, 1}})));
}

TEST_CASE("solve node: modulo a prime A x - b vanishes, and substitution solves again") {
  const System s;
  const VecX x = linear_solution(s.A, s.r), residual = s.A * x - s.r;
  for (auto r : dae::evaluate_modular(entries(residual), 0)) CHECK(r == 0);
  CHECK(generic::is_zero(residual[1]));
  CHECK_FALSE(generic::is_zero(x[1]));
  const Substitution numbers{{s.a, 1}, {s.b, 2}, {s.c, 0}};
  CHECK(substitute(x[0], numbers).is_constant());
  const Expr swapped = substitute(x[1], {{s.a, s.b}});
  CHECK(std::fabs(value(swapped, {{s.b, .4}, {s.c, 2}}) - value(x[1], {{s.a, .4}, {s.b, .4}, {s.c, 2}})) <
        1e-15);
  CHECK(substitute(x[1], {{symbol(Kind::variable, "unused"), Expr(1)}}) == x[1]);
}

TEST_CASE("solve node: prints as one short name") {
  const System s;
  const VecX x = linear_solution(s.A, s.r);
  CHECK(to_text(2 * x[0] - s.a) == "2 (A⁻¹b)₁ - a");
  CHECK(to_latex(x[1]) == "(A^{-1} b)_{2}");
}

TEST_CASE("solve: a sparse definite system is factored without pivoting, to the same values as with") {
  constexpr int n = 40;  // the matrix of a chain with a closing link, so that there is fill
  std::vector<Expr> d = symbol_vector(Kind::parameter, "sd", n + 1);
  std::vector<Entry> A;
  VecX b(n);
  std::unordered_map<Expr, double> at;
  for (int i = 0; i <= n; ++i) at[d[i]] = 1 + 0.3 * std::sin(i);
  for (int i = 0; i < n; ++i) {
    const Expr left = d[i], right = d[static_cast<std::size_t>(i) + 1];
    for (int j : {0, i - 1, i, i + 1, n - 1}) {
      if (j < 0 || j >= n || (j == 0 && i != 0 && i != n - 1 && i != 1) ||
          (j == n - 1 && i != n - 1 && i != 0 && i != n - 2))
        continue;
      if (std::any_of(A.begin(), A.end(), [&](const Entry& e) { return e.row == i && e.column == j; }))
        continue;
      const int low = std::min(i, j);
      A.push_back({i, j, i == j ? 4 * (left + right) : -d[static_cast<std::size_t>(low) + 1]});
    }
    b[i] = left * right - 1;
  }
  std::vector<Expr> leaves(d.begin(), d.end());
  std::vector<double> in;
  for (Expr leaf : leaves) in.push_back(at[leaf]);
  const VecX pivoted = linear_solution(A, b), plain = linear_solution(A, b * Expr(2), true);
  const std::vector<double> reference =
      codegen::Kernel(std::vector<Expr>(pivoted.begin(), pivoted.end()), leaves)(in);
  const codegen::Kernel kernel(std::vector<Expr>(plain.begin(), plain.end()), leaves);
  CHECK(kernel.operations() < 30 * n);  // dense elimination: 2 · n³/6 for the factors alone
  const std::vector<double> values = kernel(in);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    CHECK(values[k] == doctest::Approx(2 * reference[k]).epsilon(1e-13));
    CHECK(evaluate(std::span(&plain[i], 1), at)[0] == doctest::Approx(values[k]).epsilon(1e-13));
  }
}

}  // namespace pendula::solve_test
