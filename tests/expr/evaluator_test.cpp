// The evaluator against evaluate(), which finds the order of operations anew.
#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/evaluator.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::evaluator_test {

TEST_CASE("evaluator: functions, conditions, constants, outputs that are leaves") {
  const Expr x = symbol(Kind::variable, "x"), y = symbol(Kind::variable, "y"), t = time_symbol();
  const std::vector<Expr> leaves{x, y, t};
  const std::vector<Expr> outputs{sin(x) * y + t / (2 + x),        pow(x, y), max(x, y), y, Expr(3),
                                  ifelse(lt(x, y), x * x, sqrt(y))};
  const Evaluator f(outputs, leaves);
  for (const auto& at : {std::vector<double>{0.3, 0.7, 2.0}, std::vector<double>{1.5, 0.2, -1.0}}) {
    const auto expected = evaluate(outputs, {{x, at[0]}, {y, at[1]}, {t, at[2]}});
    CHECK(f(at) == expected);
  }
  CHECK(std::isnan(f(std::vector<double>{-1, 0.5, 0})[1]));
}

TEST_CASE("evaluator: the components of a linear system") {
  const Expr x = symbol(Kind::variable, "x"), y = symbol(Kind::variable, "y");
  MatX A(2, 2);
  A << x, Expr(1), Expr(2), y;
  VecX b(2);
  b << y, x;
  const VecX s = linear_solution(A, b);
  const std::vector<Expr> leaves{x, y}, outputs{s[1] * x, s[0]};
  const Evaluator f(outputs, leaves);
  const std::vector<double> at{3, 5};  // (3 1; 2 5) s = (5, 3)
  const auto values = f(at);
  CHECK(values[0] == doctest::Approx(-1.0 / 13 * 3).epsilon(1e-14));
  CHECK(values[1] == doctest::Approx(22.0 / 13).epsilon(1e-14));
}

TEST_CASE("evaluator: rounding errors are bounded, and not by much more than they are") {
  const Expr x = symbol(Kind::variable, "x"), y = symbol(Kind::variable, "y");
  MatX A(2, 2);
  A << 1 + x, Expr(1), Expr(1), 1 + y;
  VecX b(2);
  b << y, Expr(1);
  const std::vector<Expr> leaves{x, y};
  const std::vector<Expr> outputs{((1 + x) - 1) - x, tan(1e8 * x) - sin(1e8 * x) / cos(1e8 * x),
                                  sqrt(abs(((1 + x) - 1) - x)),
                                  pow(sin(1e7 * x), 2) + pow(cos(1e7 * x), 2) - 1, linear_solution(A, b)[0]};
  const Evaluator f(outputs, leaves);
  // exact: 0, 0, 0, 0, (y (1 + y) - 1)/(x + y + x y) with the last digits of x and y
  double worst[5] = {0, 0, 0, 0, 0};
  for (int k = 1; k <= 200; ++k) {
    const std::vector<double> at{1e-8 * k / 3, 1e-6 * k / 7};
    const auto value = f(at), bound = f.rounding_errors(at);
    const long double p = at[0], q = at[1];
    const long double exact[5] = {0, 0, 0, 0, (q * (1 + q) - 1) / (p + q + p * q)};
    for (int i = 0; i < 5; ++i) {
      const double error = std::fabs(static_cast<double>(value[i] - exact[i]));
      const double share = error == 0 ? 0 : error / bound[i];
      CAPTURE(i);
      CHECK(share <= 1);
      worst[i] = std::max(worst[i], share);
    }
  }
  for (double share : worst) CHECK(share > 0.01);
}

TEST_CASE("evaluator: what has no value is named") {
  const Expr x = symbol(Kind::variable, "x"), secret = symbol(Kind::variable, "secret");
  const std::vector<Expr> outputs{x + secret}, leaves{x};
  CHECK_THROWS_WITH_AS(Evaluator(outputs, leaves), doctest::Contains("secret"), Error);
}

}  // namespace pendula::evaluator_test
