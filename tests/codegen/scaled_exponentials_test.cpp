// Quotients of exponentials beyond the range of double numbers, against their limits
// and against plain arithmetic.
#include <cmath>
#include <vector>

#include <doctest/doctest.h>

#include "codegen/kernel/kernel.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/rewrite/scaled_exponentials.hpp"

namespace pendula::scaled_exponentials_test {

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

bool is_scaled(Expr e) { return with_scaled_exponentials(std::vector<Expr>{e})[0] != e; }

}  // namespace

TEST_CASE(
    "scaled exponentials: the derivative of a quotient of exponentials is its limit where they overflow") {
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
    CHECK(is_scaled(slope));
    for (double u : {710.0, 800.0, 1e5, 1e300}) {
      CHECK(std::fabs(value(slope, -u) - c.left) < 1e-150);
      CHECK(std::fabs(value(slope, u) - c.right) < 1e-150);
    }
  }
}

TEST_CASE("scaled exponentials: to the bit what it was where the square of the divisor is a number") {
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

TEST_CASE("scaled exponentials: higher powers") {
  const Expr e = exp(x), of = e * e / pow(1 + e, 3);
  for (double u : {-1000.0, -30.0, -1.0, 0.5, 30.0, 100.0, 230.0}) {
    const double d = 1 + std::exp(u), plain = std::exp(u) * std::exp(u) / (d * d * d);
    CHECK(value(of, u) == doctest::Approx(plain).epsilon(1e-15));
  }
  CHECK(value(of, 1000) < 1e-101);
  CHECK(value(pow(sinh(x), 3) / pow(cosh(x), 3), -1000) == doctest::Approx(-1).epsilon(1e-15));
}

TEST_CASE("scaled exponentials: quotients of several, and with factors of any size") {
  const Expr e = exp(x), both = exp(2 * x) + exp(x);
  CHECK(std::isinf(value(pow(e, 2) / (1 + e), 1000)));
  CHECK(value(e / (e + exp(y)), 1000, 1000) == 0.5);
  CHECK(value(e / (e + exp(y)), 1001, 1000) == doctest::Approx(1 / (1 + std::exp(-1.0))).epsilon(1e-15));
  CHECK(value(e / (1 + y * e), 1000, 1e-80) == doctest::Approx(1e80).epsilon(1e-15));
  CHECK(value(e / (Expr(1e120) + e), 270) ==
        doctest::Approx(1 / (1 + 1e120 * std::exp(-270.0))).epsilon(1e-13));
  CHECK(value((e / pow(1 + e, 2) + 1e-40 * y) * e, 300, 2) ==
        doctest::Approx(1 + 2e-40 * std::exp(300.0)).epsilon(1e-13));
  CHECK(value(partial(log(both), x), 1000) == 2);
  CHECK(std::isnan(value(e / (1 + e), std::nan(""))));
}

TEST_CASE("scaled exponentials: three derivatives of log(1 + exp(x)) everywhere") {
  const Expr first = partial(log(1 + exp(x)), x), second = partial(first, x), third = partial(second, x);
  for (double u = -699; u < 2000; u += 3.7) {
    const double low = std::exp(-std::fabs(u)), s = u > 0 ? 1 / (1 + low) : low / (1 + low),
                 other = u > 0 ? low / (1 + low) : 1 / (1 + low);
    CHECK(std::fabs(value(first, u) - s) <= 1e-12 * s);
    CHECK(std::fabs(value(second, u) - s * other) <= 1e-12 * s);
    CHECK(std::fabs(value(third, u) - s * other * (other - s)) <= 1e-12 * s);
  }
}

TEST_CASE("scaled exponentials: what cannot be ∞/∞ is left alone") {
  CHECK_FALSE(is_scaled(1 / (1 + exp(x))));
  CHECK_FALSE(is_scaled(x * exp(x) + 1 / (1 + exp(x))));
  CHECK_FALSE(is_scaled(y * exp(x) * exp(-x * x)));
  CHECK_FALSE(is_scaled(sin(exp(x)) / (1 + exp(x))));
}

TEST_CASE("scaled exponentials: products inside the exponent of another one") {
  const Expr inner = 1 / (1 + exp(-x)), outer = 1 / (1 + exp(-1000 * inner));
  CHECK(value(partial(outer, x), 2000) == 0);
  CHECK(std::fabs(value(partial(outer, x), -2000)) < 1e-150);
}

TEST_CASE("scaled exponentials: logarithms of sums of exponentials") {
  struct Case {
    Expr of;
    double at;    ///< x
    double sure;  ///< the value there
  };
  const double ln2 = std::log(2.0);
  for (const Case& c : {Case{log(1 + exp(x)), 800, 800},
                        {log(1 + exp(x)), -800, 0},
                        {log(3 + 2 * exp(x / 2)), 1e5, 5e4 + ln2},
                        {log(cosh(x)), -1000, 1000 - ln2},
                        {log(exp(2 * x) + exp(x)), -900, -900},
                        {log(exp(2 * x) + exp(x)), 900, 1800},
                        {log(x * exp(x) - exp(-x) / 4), 1000, 1000 + std::log(1000.0)},
                        {log(1 + exp(1000 + log(1 + exp(x)))), 1000, 2000},
                        {log(1e-300 * exp(x) + 1), 700, std::log1p(std::exp(700 - 300 * std::log(10.0)))}})
    CHECK(value(c.of, c.at) == doctest::Approx(c.sure).epsilon(1e-14));
  for (double u = -40; u < 40; u += 0.73) CHECK(value(log(1 + exp(x)), u) == std::log(1 + std::exp(u)));
  CHECK(value(log(1 + exp(x) * exp(x)), 500) == 1000);
  CHECK(value(-log(exp(-x) + exp(-2 * x)), 900) == 900);  // a soft minimum
  CHECK(std::isnan(value(log(1 + exp(x)), std::nan(""))));
  CHECK(std::isnan(value(log(1 - exp(x)), 800)));
}

TEST_CASE("scaled exponentials: quotients whose terms all vanish are their limits") {
  const Expr f = log(exp(2 * x) + exp(x)), slope = partial(f, x),
             weight = exp(-x * x) / (exp(-x * x) + 3 * exp(-(x - y) * (x - y)));
  for (const double far : {-400.0, -800.0, -1e5})
    CHECK(value(slope, far) == doctest::Approx(1).epsilon(1e-15));
  for (const double far : {400.0, 1e5}) CHECK(value(slope, far) == doctest::Approx(2).epsilon(1e-15));
  CHECK(std::abs(value(partial(slope, x), -800.0)) < 1e-15);
  CHECK(value(exp(x) / (exp(2 * x) + exp(x) * y), -900.0, 4) == doctest::Approx(0.25).epsilon(1e-15));
  CHECK(value(pow(exp(2 * x) + 4 * exp(2 * x - y), Expr(-0.5)) * exp(x), -900.0) ==
        doctest::Approx(1 / std::sqrt(5)).epsilon(1e-14));
  // the larger of two densities, far out
  CHECK(value(weight, 40.0, 2) == doctest::Approx(std::exp(-156 - std::log(3))).epsilon(1e-12));
  CHECK(value(weight, -40.0, 2) == doctest::Approx(1).epsilon(1e-15));
  CHECK_FALSE(is_scaled(exp(x) * (1 + y) / 3));  // no divisor vanishes
}

}  // namespace pendula::scaled_exponentials_test
