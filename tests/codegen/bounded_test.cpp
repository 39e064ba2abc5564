// Quotients of exponentials beyond the range of double numbers, against their limits
// and against plain arithmetic.
#include <cmath>
#include <vector>

#include <doctest/doctest.h>

#include "codegen/kernel/kernel.hpp"
#include "codegen/program/bounded.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::bounded_test {

using namespace pendula::codegen;

namespace {

const Expr x = symbol(Kind::variable, "x"), y = symbol(Kind::variable, "y");

double value(Expr e, double at_x, double at_y = 0) {
  const std::vector<Expr> outputs{e}, inputs{x, y};
  const double in[] = {at_x, at_y};
  double out = 0;
  Kernel(outputs, inputs)(in, &out);
  return out;
}

bool is_bounded(Expr e) { return bounded_quotients(std::vector<Expr>{e})[0] != e; }

}  // namespace

TEST_CASE("bounded: the derivative of a quotient of exponentials is its limit where they overflow") {
  struct Case {
    Expr of;
    double left, right;  // of the derivative, far out
  };
  const Expr far = x * (2 + y);
  for (const Case& c : {Case{1 / (1 + exp(x)), 0, 0},
                        {3 / (2 + 5 * exp(-far)), 0, 0},
                        {log(1 + exp(-x)), -1, 0},
                        {1 / cosh(x), 0, 0},
                        {1 / pow(cosh(x), 2), 0, 0},
                        {2 / (exp(x) + exp(-x)), 0, 0},
                        {y - 1 / (4 - exp(x) / 3), 0, 0},
                        {1 / (1 + exp(-x)) / (1 + exp(-x)), 0, 0}}) {
    const Expr slope = partial(c.of, x);
    CHECK(is_bounded(slope));
    for (double u : {710.0, 800.0, 1e5, 1e300}) {
      CHECK(std::fabs(value(slope, -u) - c.left) < 1e-150);
      CHECK(std::fabs(value(slope, u) - c.right) < 1e-150);
    }
  }
}

TEST_CASE("bounded: to the bit what it was where the square of the divisor is a number") {
  const Expr of = 3 / (2 + 5 * exp(x)), slope = partial(of, x);
  for (double u = -354; u < 353; u += 0.37) {
    const double e = std::exp(u), plain = -(5 * e * (3 / (2 + 5 * e) / (2 + 5 * e)));
    CHECK(value(slope, u) == doctest::Approx(plain).epsilon(1e-15));
  }
  CHECK(value(exp(x) / (1 + exp(x)), 709) == 1);
  CHECK(value(exp(x) / (1 + exp(x)), 1e4) == 1);
  CHECK(value(exp(x) * exp(x) / pow(1 + 3 * exp(x), 2), 1e4) == doctest::Approx(1 / 9.0).epsilon(1e-15));
  CHECK(value(tan(y) * (exp(x) - exp(-x)) / (exp(x) + exp(-x)), -1e4, 0.5) == -std::tan(0.5));
}

TEST_CASE("bounded: higher powers") {
  const Expr e = exp(x), of = e * e / pow(1 + e, 3);
  for (double u : {-1000.0, -30.0, -1.0, 0.5, 30.0, 100.0, 230.0}) {
    const double d = 1 + std::exp(u), plain = std::exp(u) * std::exp(u) / (d * d * d);
    CHECK(value(of, u) == doctest::Approx(plain).epsilon(1e-15));
  }
  CHECK(value(of, 1000) < 1e-101);
  CHECK(value(pow(sinh(x), 3) / pow(cosh(x), 3), -1000) == doctest::Approx(-1).epsilon(1e-15));
}

TEST_CASE("bounded: what has another limit, or none that is known, is left alone") {
  const Expr e = exp(x);
  CHECK_FALSE(is_bounded(pow(e, 2) / (1 + e)));            // infinite
  CHECK_FALSE(is_bounded(e / (e + exp(y))));               // anything between 0 and 1
  CHECK_FALSE(is_bounded(e / (1 + y * e)));                // 1/y, of a y that may be tiny
  CHECK_FALSE(is_bounded(e / (1 + Expr(1e-80) * e)));      // 10⁸⁰, beyond e = 10⁸⁰
  CHECK_FALSE(is_bounded(e / (Expr(1e120) + e)));          // 1, beyond e = 10¹²⁰
  CHECK_FALSE(is_bounded((1 + e) / (1 + e * y)));          // 1/y
  CHECK_FALSE(is_bounded(exp(x) * x + 1 / (1 + exp(x))));  // infinite
  CHECK(std::isnan(value(e / (e + exp(y)), 1000, 1000)));  // said by whoever asks, not guessed
  CHECK(std::isnan(value(e / (1 + e), std::nan(""))));
}

TEST_CASE("bounded: products inside the exponent of another one") {
  const Expr inner = 1 / (1 + exp(-x)), outer = 1 / (1 + exp(-1000 * inner));
  CHECK(value(partial(outer, x), 2000) == 0);
  CHECK(std::fabs(value(partial(outer, x), -2000)) < 1e-150);
}

}  // namespace pendula::bounded_test
