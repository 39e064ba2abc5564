// Exact linear algebra against doubles, against identities, and where it must refuse.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/rational.hpp"
#include "expr/linalg/linalg.hpp"

namespace pendula::linalg_test {

namespace {

const Expr x = symbol(Kind::variable, "lx"), y = symbol(Kind::variable, "ly"),
           z = symbol(Kind::variable, "lz");
const std::unordered_map<Expr, double> at = {{x, 0.3}, {y, 0.7}, {z, -1.1}};

MatX random_rational(int rows, int cols, unsigned seed) {
  std::mt19937 random(seed);
  MatX a(rows, cols);
  for (Expr& e : a.reshaped())
    e = Expr(static_cast<int>(random() % 19) - 9) / Expr(static_cast<int>(random() % 6) + 1);
  return a;
}

MatX random_symbolic(int n, unsigned seed) {
  std::mt19937 random(seed);
  const std::vector<Expr> pool = {x, y, z, x * y, sin(x), 1, 2, 0, 0, x + z};
  MatX a(n, n);
  for (Expr& e : a.reshaped()) e = pool[random() % pool.size()];
  for (int i = 0; i < n; ++i) a(i, i) += Expr(3);
  return a;
}

Mat numbers(const MatX& a) {
  const auto values = evaluate(entries(a), at);
  return Eigen::Map<const Mat>(values.data(), a.rows(), a.cols());
}

MatX product(const MatX& a, const MatX& b) {
  MatX c = MatX::Zero(a.rows(), b.cols());
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (Eigen::Index j = 0; j < b.cols(); ++j)
      for (Eigen::Index k = 0; k < a.cols(); ++k) c(i, j) += a(i, k) * b(k, j);
  return c;
}

bool same(const MatX& a, const MatX& b) { return a.rows() == b.rows() && a.cols() == b.cols() && a == b; }

}  // namespace

TEST_CASE("rational: determinant, inverse and solution are exact and agree with doubles") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    const int n = static_cast<int>(seed % 7) + 1;
    const MatX a = random_rational(n, n, seed), b = random_rational(n, 2, seed + 100);
    const Expr det = linalg::determinant(a);
    const double reference = numbers(a).determinant();
    CHECK(std::fabs(constant_value(det) - reference) <= 1e-9 * (1 + std::fabs(reference)));
    if (det.is_zero()) continue;
    CHECK(same(product(a, linalg::inverse(a)), MatX(MatX::Identity(n, n))));
    CHECK(same(product(a, linalg::solve(a, b)), b));
    CHECK(linalg::determinant(linalg::inverse(a)) == Expr(1) / det);
  }
}

TEST_CASE("rational: the Hilbert matrix of order 12, hopeless in doubles") {
  MatX h(12, 12);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) h(i, j) = Expr(mpq_class(1, i + j + 1));
  const MatX inverse = linalg::inverse(h);
  CHECK(inverse(0, 0) == Expr(144));  // n²
  CHECK(same(product(h, inverse), MatX(MatX::Identity(12, 12))));
}

TEST_CASE("rational: rank and null vectors") {
  MatX a(3, 3);
  a << 1, 2, 3, 2, 4, 6, 1, 0, 1;
  CHECK(linalg::rank(a) == 2);
  const auto v = linalg::null_vector(a);
  REQUIRE(v.has_value());
  CHECK(same(product(a, *v), MatX(MatX::Zero(3, 1))));
  CHECK_FALSE(linalg::null_vector(random_rational(4, 4, 5)).has_value());
  CHECK_THROWS_WITH_AS(linalg::inverse(a), doctest::Contains("A v = 0 for v = (1, 1, -1)"), Error);
  CHECK(linalg::rank(MatX(MatX::Zero(2, 5))) == 0);
  CHECK(linalg::determinant(MatX(0, 0)) == Expr(1));
}

TEST_CASE("symbolic: minors and elimination agree with doubles at a point, small and large") {
  for (int n : {1, 2, 3, 4, 5, 8, 9, 14}) {
    CAPTURE(n);
    const MatX a = random_symbolic(n, static_cast<unsigned>(n));
    const MatX b = random_rational(n, 2, 3);
    const Expr det = linalg::determinant(a);
    const double reference = numbers(a).determinant();
    CHECK(std::fabs(evaluate({&det, 1}, at)[0] - reference) <= 1e-10 * (1 + std::fabs(reference)));
    const Mat solution = numbers(linalg::solve(a, b));
    CHECK((numbers(a) * solution - numbers(b)).norm() <= 1e-10 * (1 + solution.norm()));
  }
}

TEST_CASE("symbolic: what vanishes identically is seen although it is not folded") {
  CHECK(generic::is_zero(pow(x + y, 2) - x * x - Expr(2) * x * y - y * y));
  CHECK(generic::is_zero(sin(x) * sin(x) + cos(x) * cos(x) - 1));
  CHECK_FALSE(generic::is_zero(sin(x) * sin(x) + cos(x) * cos(x) - Expr(mpq_class(999999, 1000000))));
  CHECK_FALSE(generic::is_zero(x * Expr(1e-9)));
  CHECK(generic::is_zero(sqrt(Expr(2)) * sqrt(Expr(3)) - sqrt(Expr(6))));
  MatX a(3, 3);
  a << x, y, x + y, y, z, y + z, 1, x, x + 1;
  CHECK(linalg::rank(a) == 2);
  CHECK(generic::is_zero(linalg::determinant(a)));
  CHECK_THROWS_WITH_AS(linalg::solve(a, MatX::Identity(3, 3)), doctest::Contains("singular for all values"),
                       Error);
  MatX trigonometric(2, 2);
  trigonometric << sin(x) * sin(x) + cos(x) * cos(x), 1, 1, 1;
  CHECK(linalg::rank(trigonometric) == 1);
}

TEST_CASE("symbolic: a straight line of eliminations stays cheap") {
  const MatX a = random_symbolic(40, 11);
  const std::size_t before = graph_size();
  const MatX solution = linalg::solve(a, MatX::Identity(40, 1));
  CHECK(graph_size() - before < 300'000);  // O(n³) operations
  CHECK((numbers(a) * numbers(solution) - Mat::Identity(40, 1)).norm() < 1e-8);
}

TEST_CASE("characteristic polynomials: a matrix satisfies its own (Cayley–Hamilton)") {
  for (int n : {1, 2, 5}) {
    const MatX a = random_rational(n, n, 17);
    const VecX c = linalg::characteristic(a);
    MatX p = MatX::Zero(n, n), power = MatX::Identity(n, n);
    for (int k = n; k >= 0; --k) {
      p += power.unaryExpr([&](Expr e) { return c[k] * e; });
      power = product(power, a);
    }
    CHECK(same(p, MatX::Zero(n, n)));
    CHECK(c[n] == (n % 2 ? -linalg::determinant(a) : linalg::determinant(a)));
  }
}

TEST_CASE("eigenvalues: exact where rational up to one quadratic factor, nothing otherwise") {
  MatX a(3, 3);
  a << 2, 1, 0, 0, 2, 0, 5, 7, mpq_class(1, 3).get_d();
  const auto triangular = linalg::exact_eigenvalues(a);
  REQUIRE(triangular.has_value());
  CHECK((*triangular)[0].re == Expr(mpq_class(1, 3)));
  CHECK((*triangular)[1].re == Expr(2));
  CHECK((*triangular)[2].re == Expr(2));
  MatX rotation(2, 2);
  rotation << 0, 1, -4, 0;
  const auto complex = linalg::exact_eigenvalues(rotation);
  REQUIRE(complex.has_value());
  CHECK((*complex)[0].im == Expr(-2));
  CHECK((*complex)[1].im == Expr(2));
  MatX cubic(3, 3);  // s³ = 2
  cubic << 0, 1, 0, 0, 0, 1, 2, 0, 0;
  CHECK_FALSE(linalg::exact_eigenvalues(cubic).has_value());
}

TEST_CASE("doubles: eigenvectors, exponential, refusals") {
  Mat a(2, 2);
  a << 0, 1, -2, -3;
  const auto e = linalg::eigensystem(a);
  CHECK(e.re[0] == doctest::Approx(-2));
  CHECK(e.re[1] == doctest::Approx(-1));
  CHECK((a * e.vectors_re - e.vectors_re * Mat(e.re.asDiagonal())).norm() < 1e-14);
  Mat j(2, 2);
  j << 0, 1, 0, 0;
  CHECK((linalg::exponential(j) - (Mat(2, 2) << 1, 1, 0, 1).finished()).norm() < 1e-15);
  CHECK_THROWS_AS(linalg::exponential(Mat(Mat::Constant(1, 1, 1e4))), Failure);
  Mat singular(2, 2);
  singular << 1, 2, 2, 4;
  CHECK(linalg::rank(singular) == 1);
  CHECK_THROWS_WITH_AS(linalg::solve(singular, Mat::Identity(2, 1)), doctest::Contains("A v = 0 for v = ("),
                       Error);
  CHECK_THROWS_AS(linalg::inverse(Mat(Mat::Zero(2, 3))), Error);
  CHECK_THROWS_AS(linalg::rank(Mat(Mat::Constant(2, 2, NAN))), Error);
}

TEST_CASE("exponentials: exact ones satisfy X′ = A X, X(0) = I") {
  const Expr t = time_symbol();
  MatX jordan(3, 3), mixed(3, 3);
  jordan << -1, 1, 0, 0, -1, 1, 0, 0, -1;
  mixed << 1, 2, 0, 0, 3, 1, 0, 0, 1;
  for (const MatX& a : {jordan, mixed}) {
    const auto e = linalg::exact_exponential(a.unaryExpr([&](Expr entry) { return entry * t; }));
    REQUIRE(e.has_value());
    const MatX slope = e->unaryExpr([](Expr entry) { return total_derivative(entry); }),
               right = product(a, *e);
    for (Eigen::Index k = 0; k < 9; ++k) CHECK(generic::is_zero(slope.data()[k] - right.data()[k]));
    for (Eigen::Index k = 0; k < 9; ++k)
      CHECK(substitute(e->data()[k], {{t, 0}}) == (k % 4 == 0 ? Expr(1) : Expr(0)));
  }
  MatX rotation(2, 2);
  rotation << 0, t, -t, 0;
  CHECK_FALSE(linalg::exact_exponential(rotation).has_value());
}

TEST_CASE("implicit derivatives: formula (65) on the circle, and where ∂r/∂z is singular") {
  const Expr r = x * x + y * y - 1;
  const MatX slope = linalg::implicit_jacobian({&r, 1}, {&y, 1}, {&x, 1});
  CHECK(generic::is_zero(slope(0, 0) + x / y));
  const Expr flat = x * x;
  CHECK_THROWS_WITH_AS(linalg::implicit_jacobian({&flat, 1}, {&y, 1}, {&x, 1}),
                       doctest::Contains("not regular"), Error);
}

}  // namespace pendula::linalg_test
