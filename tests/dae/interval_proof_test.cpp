#include "dae/points/interval_proof.hpp"

#include <doctest/doctest.h>

#include "expr/graph/graph.hpp"

namespace pendula::interval_proof_test {

namespace {

Expr x() { return symbol(Kind::variable, "x"); }
Expr y() { return symbol(Kind::variable, "y"); }
Expr z() { return symbol(Kind::variable, "z"); }

bool impossible(std::vector<Expr> rows) { return dae::has_no_solution(rows, {{x(), 3.0}}); }

}  // namespace

TEST_CASE("equations without solution at x = 3 are proved to have none") {
  CHECK(impossible({x() * x() + y() * y() - 1}));
  CHECK(impossible({pow(x(), 2) + pow(y(), 4) - 8.9}));
  CHECK(impossible({exp(y()) + x()}));
  CHECK(impossible({exp(y() / 3)}));  // never 0
  CHECK(impossible({sin(y()) + x()}));
  CHECK(impossible({sqrt(y()) + x()}));
  CHECK(impossible({log(y() * y() + 1) + x()}));
  CHECK(impossible({pow(y(), 4) - 3 * y() + x()}));
  CHECK(impossible({pow(y(), 2) - 2 * y() + x()}));
  CHECK(impossible({x() * y(), y() - 1}));
  CHECK(impossible({x() / y()}));
  CHECK(impossible({abs(y()) - 2, y() * z() - 1, z() - x()}));
  CHECK(impossible({max(y(), x()) - 2}));
  // y = ±1 leaves z = ±1 and its sign: both halves are looked at
  CHECK(impossible({y() * y() - 1, z() - y(), y() * z() + 1}));
  CHECK(impossible({y() + z() - 1, y() * z() - 5}));  // y is unbounded at first
  CHECK(impossible({y() + z() - 1, pow(y(), 2) + pow(z(), 2) - 0.3}));
  CHECK(impossible({tanh(y()) - 0.5, y() + x()}));
  CHECK(impossible({cosh(y()) - 2, y() - x()}));
  CHECK(impossible({sinh(asinh(y())) - 2, y() - x()}));
  CHECK(impossible({y() * y() + exp(z())}));
  CHECK(impossible({abs(y()) + cosh(z()) - 1 + exp(y())}));
}

TEST_CASE("branches without solution are proved to have none") {
  CHECK(impossible({min(y(), z()), y() + z() + 1}));
  CHECK(impossible({max(y(), z()) + 1, y() + z()}));
  CHECK(impossible({ifelse(lt(y(), Expr(0)), y() - 1, y() + 1)}));
  CHECK(impossible({ifelse(le(y(), Expr(2)), y() - x(), y() + x())}));
  CHECK(impossible({asin(y()) - x()}));
  CHECK(impossible({acos(y()) + 0.1}));
  CHECK(impossible({atan2(y(), z()) - 2 * x()}));
}

TEST_CASE("nothing is proved where there is a solution, at bounds and double roots either") {
  CHECK_FALSE(impossible({x() * x() + y() * y() - 9}));        // y = 0
  CHECK_FALSE(impossible({pow(y(), 2) - 2 * y() + x() - 2}));  // y = 1, twice
  CHECK_FALSE(impossible({exp(y()) - x()}));
  CHECK_FALSE(impossible({y() - 2 - exp(1000 * (1 - y()))}));  // e⁻¹⁰⁰⁰ is not 0
  CHECK_FALSE(impossible({1e-200 * y() - 1e-200 * z(), y() - pow(1e-200 * x(), 2)}));  // nor is 9·10⁻⁴⁰⁰
  CHECK_FALSE(impossible({1e-300 * exp(y()) - 1e100, y() - 921.0340371976183}));  // e⁹²¹ = 10⁴⁰⁰
  CHECK_FALSE(impossible({sin(y()) - 1}));
  CHECK_FALSE(impossible({cos(y()) + 1, y() - 3.141592653589793}));
  CHECK_FALSE(impossible({sqrt(y()), y()}));
  CHECK_FALSE(impossible({x() * y(), y() * z()}));
  CHECK_FALSE(impossible({y() / x() - 1 / x(), y() - 1}));
  CHECK_FALSE(impossible({atan2(y(), x())}));
  CHECK_FALSE(impossible({abs(y()) - 2, y() + 2}));
  CHECK_FALSE(impossible({min(y(), x()) - 2, y() - 2}));
  CHECK_FALSE(impossible({min(y(), z()), y() + z() - 1}));
  CHECK_FALSE(impossible({max(y(), z()), y() + z()}));  // both 0
  CHECK_FALSE(impossible({ifelse(lt(y(), Expr(0)), y() + 1, y() + 1)}));
  CHECK_FALSE(impossible({ifelse(le(y(), Expr(2)), y() - 2, y() + x())}));
  CHECK_FALSE(impossible({ifelse(lt(y(), Expr(2)), y() + x(), y() - 2)}));
  CHECK_FALSE(impossible({atan2(y(), z()) - pi(), z() + 1}));
  CHECK_FALSE(impossible({acos(y()) - pi(), y() + 1}));
  CHECK_FALSE(impossible({cosh(y()) - 1, y()}));
  CHECK_FALSE(impossible({abs(y()) + cosh(z()) - 1 + z() * z()}));
  CHECK_FALSE(impossible({log(y()) + z() * z()}));  // y = 1, z = 0
  CHECK_FALSE(impossible({tanh(y()) - 0.5, sinh(z()) - y()}));
  CHECK_FALSE(impossible({y() + z() - 1, y() * z() - 0.25}));  // 1/2, twice
  CHECK_FALSE(impossible({pow(y(), -1) - 1e300, y() - 1e-300}));
  CHECK_FALSE(impossible({Expr(0.1) * x() + Expr(0.2) * x() - Expr(0.3) * x()}));
}

}  // namespace pendula::interval_proof_test
