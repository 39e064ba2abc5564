// The evaluator against evaluate(), which finds the order of operations anew.
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

TEST_CASE("evaluator: what has no value is named") {
  const Expr x = symbol(Kind::variable, "x"), secret = symbol(Kind::variable, "secret");
  const std::vector<Expr> outputs{x + secret}, leaves{x};
  CHECK_THROWS_WITH_AS(Evaluator(outputs, leaves), doctest::Contains("secret"), Error);
}

}  // namespace pendula::evaluator_test
