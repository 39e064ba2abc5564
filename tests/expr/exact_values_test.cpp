// Values of the schoolbook, zero among exact numbers, identities of angles and fractions, decimals in print.
#include <doctest/doctest.h>

#include <cmath>

#include "base/error.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/angle.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/approximation.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/assumption.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::exact_values_test {

namespace {

Expr fraction(long above, long below) { return Expr(above) / Expr(below); }

MatX two_by_two(Expr a, Expr b, Expr c, Expr d) {
  MatX m(2, 2);
  m << a, b, c, d;
  return m;
}

}  // namespace

TEST_CASE("exact values: sin, cos and tan at multiples of pi are the numbers that doubles are near to") {
  for (long k = -30; k <= 30; ++k)
    for (long below : {1, 2, 3, 4, 5, 6, 8, 10, 12}) {
      const Expr angle = fraction(k, below) * pi();
      const double x = static_cast<double>(k) / static_cast<double>(below) * std::acos(-1.0);
      for (Op op : {Op::sin, Op::cos}) {
        const Expr value = make(op, angle);
        CHECK(value.op() != op);
        CHECK(evaluate({&value, 1}, {})[0] == doctest::Approx(apply(op, x, 0, 0)).epsilon(1e-12));
      }
      if (std::fabs(std::cos(x)) > 1e-9) {
        const Expr value = tan(angle);
        CHECK(value.op() != Op::tan);
        CHECK(evaluate({&value, 1}, {})[0] == doctest::Approx(std::tan(x)).epsilon(1e-9));
      }
    }
  CHECK(cos(pi()) == Expr(-1));
  CHECK(sin(-pi()) == Expr(0));
  CHECK(cos(2 * pi() / 3) == fraction(-1, 2));
  CHECK(simplify(cos(pi() / 5)) == simplify((1 + sqrt(Expr(5))) / 4));
  CHECK(cos(pi() / 7).op() == Op::cos);
  CHECK(sin(pi() / 24).op() == Op::sin);
  CHECK_THROWS_AS(tan(pi() / 2), Error);
}

TEST_CASE("exact values: inverse functions at simple numbers") {
  CHECK(asin(Expr(1)) == pi() / 2);
  CHECK(acos(Expr(-1)) == pi());
  CHECK(acos(fraction(-1, 2)) == fraction(2, 3) * pi());
  CHECK(atan(Expr(-1)) == -(pi() / 4));
  for (long k = -2; k <= 2; ++k)
    for (Op op : {Op::asin, Op::acos}) {
      const Expr value = make(op, fraction(k, 2));
      CHECK(evaluate({&value, 1}, {})[0] == doctest::Approx(apply(op, static_cast<double>(k) / 2, 0, 0)));
    }
  CHECK(asin(fraction(1, 3)).op() == Op::asin);
}

TEST_CASE("exact values: rank, determinant and solve agree about zero among exact numbers") {
  const Expr e = exp(Expr(1)), r2 = sqrt(Expr(2)), r3 = sqrt(Expr(3)), r6 = sqrt(Expr(6));
  const MatX singular[] = {two_by_two(1, 1, 1, -cos(pi())),
                           two_by_two(e, e * e, 1, e),
                           two_by_two(exp(Expr(3)), e, exp(Expr(2)), 1),
                           two_by_two(r2, r6, 1, r3),
                           two_by_two(cos(Expr(2)), 2, cos(Expr(1)) * cos(Expr(1)) - fraction(1, 2), 1),
                           two_by_two(exp(fraction(1, 2)), e, 1, exp(fraction(1, 2)))};
  for (const MatX& m : singular) {
    CAPTURE(matrix_to_text(m));
    CHECK(linalg::rank(m) == 1);
    CHECK(simplify(linalg::determinant(m)).is_zero());
    CHECK(linalg::null_vector(m).has_value());
    CHECK_THROWS_AS(linalg::inverse(m), Error);
  }
  MatX one(1, 1);
  one << sin(pi());
  CHECK(linalg::rank(one) == 0);
  const MatX regular[] = {two_by_two(r2, r6, 1, r2), two_by_two(e, pi(), 1, 1),
                          two_by_two(1, pi(), pi(), 10)};
  for (const MatX& m : regular) {
    CHECK(linalg::rank(m) == 2);
    CHECK_FALSE(generic::is_zero(linalg::determinant(m)));
  }
}

TEST_CASE("simplify: squares and products of sines and cosines with coefficients") {
  const Expr a = symbol(Kind::variable, "exa"), b = symbol(Kind::variable, "exb");
  const Expr m = symbol(Kind::parameter, "exm");
  CHECK(simplify(m * sin(a) * sin(b) + m * cos(a) * cos(b)) == simplify(m * cos(a - b)));
  CHECK(simplify(cos(a) * cos(b) - sin(a) * sin(b)) == simplify(cos(a + b)));
  CHECK(simplify(sin(a) * cos(b) - cos(a) * sin(b)) == simplify(sin(a - b)));
  CHECK(simplify(2 * sin(a) * cos(b) * m + 2 * m * cos(a) * sin(b)) == simplify(2 * m * sin(a + b)));
  CHECK(simplify(3 * pow(sin(a), 2) + 5 * pow(cos(a), 2)) == simplify(3 + 2 * pow(cos(a), 2)));
  CHECK(simplify(sin(a + pi())) == simplify(-sin(a)));
  CHECK(simplify(cos(a + 3 * pi() / 2)) == simplify(sin(a)));
  CHECK(simplify(sin(a + pi()) + sin(a)).is_zero());
  CHECK(generic::is_zero(sin(a + pi()) + sin(a)));
  CHECK(generic::is_zero(cos(a - pi() / 2) - sin(a)));
  CHECK_FALSE(generic::is_zero(cos(a - pi() / 2) + sin(a)));
}

TEST_CASE("simplify: a symbol is neither its exponential nor the tangent of its half") {
  const Expr a = symbol(Kind::variable, "exa"), b = symbol(Kind::parameter, "exm");
  for (Expr x : {a, b, a + 2 * b, 3 * a}) {
    const Expr never[] = {x - exp(x), 2 * x - sinh(x) - cosh(x), sin(x) - 2 * x / (1 + x * x), x - tan(x / 2),
                          exp(x) - 2 * x / (1 + x * x)};
    for (Expr e : never) {
      CHECK_FALSE(generic::is_zero(e));
      CHECK_FALSE(simplify(e).is_zero());
    }
  }
  CHECK_FALSE(generic::is_zero(exp(Expr(1)) - 1));
}

TEST_CASE("simplify: fractions have one denominator where that is shorter") {
  const Expr a = symbol(Kind::parameter, "exp1"), b = symbol(Kind::parameter, "exp2");
  const Expr F = symbol(Kind::input, "exF");
  CHECK(simplify(1 / (1 / a + 1 / b)) == simplify(a * b / (a + b)));
  CHECK(simplify((1 - 1 / (a * (1 / a + 1 / b))) * F / a) == simplify(F / (a + b)));
  CHECK(simplify(1 - b / (a + b)) == simplify(a / (a + b)));
  CHECK(simplify(a / (a + b) + b / (a + b)) == Expr(1));
}

TEST_CASE("print: one notation for numbers, decimals where a five divides the denominator") {
  const Expr x = symbol(Kind::variable, "exx");
  CHECK(to_text(fraction(1, 5)) == "0.2");
  CHECK(to_text(fraction(1, 2)) == "1/2");
  CHECK(to_text(fraction(3, 10) * x) == "0.3 " + to_text(x));
  CHECK(to_text(x / 5) == to_text(x) + "/5");
  CHECK(vector_to_text(column(std::vector<Expr>{1, fraction(1, 20), fraction(1, 2)})) == "(1, 0.05, 0.5)");
  CHECK(vector_to_text(column(std::vector<Expr>{fraction(1, 5), fraction(1, 3)})) == "(1/5, 1/3)");
  CHECK(vector_to_text(column(std::vector<Expr>{fraction(3, 2), fraction(9, 4)})) == "(3/2, 9/4)");
}

TEST_CASE("print: the decimals of numbers that are no decimals") {
  CHECK(decimal_approximation(sqrt(Expr(2))) == "≈ 1.414213562");
  CHECK(decimal_approximation(pi() / 3) == "≈ 1.047197551");
  CHECK(decimal_approximation(fraction(1, 3)).empty());
  CHECK(decimal_approximation(symbol(Kind::variable, "exx")).empty());
  CHECK(decimal_approximation(symbol(Kind::parameter, "exm") * sqrt(Expr(2))).empty());
}

TEST_CASE("simplify: what is declared positive leaves absolute values and roots") {
  const Expr m = symbol(Kind::parameter, "expos"), x = symbol(Kind::variable, "expx");
  const Expr size = abs(m * x), root = sqrt(m * m * x * x);
  const Expr before = simplify(size);
  assume_positive(m, true);
  CHECK(simplify(size) == simplify(m * abs(x)));
  CHECK(simplify(root) == simplify(m * abs(x)));
  CHECK(simplify(sqrt(pi() * pi())) == pi());
  assume_positive(m, false);
  CHECK(simplify(size) == before);
}

}  // namespace pendula::exact_values_test
