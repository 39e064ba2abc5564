// Rates of linear models, x′ = A x, whose eigenvalues are known: chains, whose rows are alone one after the
// other, with a pair or a cycle of three at the end or in the middle, in any order of the unknowns.
#include "integrate/step/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <doctest/doctest.h>

#include "tests/integrate/problems.hpp"

namespace pendula::spectrum_test {

using namespace pendula::test;

namespace {

/// Rates of x′ = A x with the unknowns in this order.
Rates rates_of(const Mat& A, const std::vector<int>& order) {
  const Mat B = A(order, order);
  std::vector<Expr> x, f;
  for (int i = 0; i < B.rows(); ++i) x.push_back(variable("s" + std::to_string(i)));
  for (int i = 0; i < B.rows(); ++i) {
    f.emplace_back(0);
    for (int j = 0; j < B.rows(); ++j)
      if (B(i, j) != 0) f.back() = f.back() + B(i, j) * x[j];
  }
  Point at = start(Vec::LinSpaced(B.rows(), 1, 2), Vec::Zero(B.rows()), Vec());
  Stats stats;
  RhsSolver derivative(problem(ode(x, f)), stats);
  REQUIRE(derivative(0, at.x.data(), at.xdot.data(), at.z.data()));
  const auto found = rates(derivative, at);
  REQUIRE(found.has_value());
  return *found;
}

void check(const Mat& A, double fastest, double damped, double growing) {
  std::vector<int> order(static_cast<std::size_t>(A.rows()));
  std::iota(order.begin(), order.end(), 0);
  constexpr double close = 1e-5;  // the matrix is one of differences
  do {
    const Rates found = rates_of(A, order);
    CHECK(std::fabs(found.fastest - fastest) <= close * fastest);
    CHECK(std::fabs(found.damped - damped) <= close * fastest);
    CHECK(std::fabs(found.growing - growing) <= close * fastest);
  } while (std::next_permutation(order.begin(), order.end()));
}

}  // namespace

TEST_CASE("rates of chains, pairs and cycles") {
  Mat A = Mat::Zero(4, 4);  // a chain of reactions
  A.diagonal() << -1, -10, -40, -100;
  A(1, 0) = 3, A(2, 0) = 5, A(3, 1) = 7;
  check(A, 100, 100, 0);
  A(3, 2) = 50, A(2, 3) = -200;  // and a pair: -70 ± √(30² - 10⁴) i
  check(A, std::sqrt(14000.0), 70, 0);
  A(2, 3) = 20;  // -70 ± √(900 + 1000)
  check(A, 70 + std::sqrt(1900.0), 70 + std::sqrt(1900.0), 0);
  A(2, 3) = 200;  // -70 ± √10900
  check(A, 70 + std::sqrt(10900.0), 70 + std::sqrt(10900.0), std::sqrt(10900.0) - 70);
  Mat C = Mat::Zero(5, 5);  // x → y → z → x with rate 6: 6 (e^{2πik/3} - 1); driven by one, and driving one
  for (int i = 1; i <= 3; ++i) C(i, i) = -6, C(i % 3 + 1, i) = 6;
  C(1, 0) = 2, C(0, 0) = 0.5, C(4, 3) = 1, C(4, 4) = -25;
  check(C, 25, 25, 0.5);
  C(4, 4) = -1;
  check(C, 6 * std::sqrt(3.0), 9, 0.5);
}

}  // namespace pendula::spectrum_test
