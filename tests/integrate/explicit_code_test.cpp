// All stages of an explicit method as machine code against the same step by loops.
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "integrate/explicit_code.hpp"
#include "tests/integrate/problems.hpp"

using namespace pendula;
using namespace pendula::test;
using namespace pendula::integrate;

namespace {

Expr x() { return variable("x"); }
Expr y() { return variable("y"); }

/// Depends on t in a part of its own, and on a state through functions.
dae::FirstOrder forced() {
  const Expr t = time_symbol();
  return ode({x(), y()}, {y() * cos(x()) + sin(3 * t), -x() * x() * y() + exp(-t) / (2 + sin(3 * t))});
}

Point random_point(int n, std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  Point p = start(Vec::NullaryExpr(n, [&] { return u(random); }));
  p.t = 0.3;
  p.xdot = Vec::NullaryExpr(n, [&] { return u(random); });
  return p;
}

}  // namespace

TEST_CASE("explicit code: the stages of an explicit method") {
  if (!codegen::Machine::available()) return;
  const TableauPtr method =
      drawn("0 | \n 1/2 | 1/2 \n 1/2 | 0 1/2 \n 1 | 0 0 1 \n | 1/6 1/3 1/3 1/6 \n | 0 1 0 0");
  const ProblemPtr p = problem(forced());
  const Tableau& rk = *method;
  const auto code = ExplicitCode::make(*p, rk);
  REQUIRE(code);
  std::mt19937 random(1);
  for (int run = 0; run < 20; ++run) {
    const Point from = random_point(2, random);
    const double dt = 0.1;
    std::vector<double> out(2 * 6);
    code->run(*p, from, dt, out.data());
    Mat K(2, 4);
    K.col(0) = from.xdot;
    for (int i = 1; i < 4; ++i) {
      const Vec at = from.x + dt * K.leftCols(i) * rk.A().row(i).head(i).transpose();
      p->place(from.t + rk.c()[i] * dt, at.data(), from.xdot.data(), nullptr);
      p->rhs(K.col(i).data());
    }
    const Vec end = from.x + dt * K * rk.b(), error = dt * K * (rk.b() - *rk.bhat());
    for (int k = 0; k < 2; ++k) {
      for (int i = 1; i < 4; ++i)
        CHECK(std::fabs(out[static_cast<std::size_t>(2 * (i - 1) + k)] - K(k, i)) < 1e-14);
      CHECK(std::fabs(out[static_cast<std::size_t>(6 + k)] - end[k]) < 1e-14);
      CHECK(std::fabs(out[static_cast<std::size_t>(8 + k)] - error[k]) < 1e-15);
      CHECK(out[static_cast<std::size_t>(10 + k)] == 0);  // no second embedded method
    }
  }
}
