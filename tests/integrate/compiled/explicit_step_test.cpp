// All stages of an explicit method as machine code against the same step by loops.
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "dae/model/first_order.hpp"
#include "integrate/compiled/explicit_step.hpp"
#include "tests/integrate/problems.hpp"
#include "tests/refuse_code.hpp"
#include "tests/require_code.hpp"

namespace pendula::explicit_step_test {

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

TEST_CASE("explicit code: the end of a step, its error and the test of stiffness") {
  REQUIRE_CODE(1);
  // The last stage but one stands at the end of the step.
  const TableauPtr method =
      drawn("0 | \n 1/2 | 1/2 \n 1/2 | 0 1/2 \n 1 | 0 0 1 \n | 1/6 1/3 1/3 1/6 \n | 0 1 0 0");
  const ProblemPtr p = problem(forced());
  const Tableau& rk = *method;
  const int g = 3;
  Tolerances tolerances = Tolerances::uniform(2, 0, 0);
  tolerances.rtol << 1e-3, 1e-2;
  tolerances.atol << 1e-4, 1e-5;
  const auto code = CompiledExplicitStep::make(*p, rk, g, tolerances);
  REQUIRE(code);
  std::mt19937 random(1);
  for (int run = 0; run < 20; ++run) {
    const Point from = random_point(2, random);
    const double dt = 0.1;
    const auto out = code->run(*p, from, dt);
    Mat K(2, 4);
    Vec at, slope(2);
    const auto evaluate = [&](double t, const Vec& x, double* f) {
      p->set_point(t, x.data(), from.xdot.data(), nullptr);
      p->rhs(f);
    };
    K.col(0) = from.xdot;
    for (int i = 1; i < 4; ++i) {
      at = from.x + dt * K.leftCols(i) * rk.A().row(i).head(i).transpose();
      evaluate(from.t + rk.c()[i] * dt, at, K.col(i).data());
    }
    const Vec end = from.x + dt * K * rk.b();
    evaluate(from.t + dt, end, slope.data());
    const Vec sizes = from.x.cwiseAbs().cwiseMax(end.cwiseAbs());
    const Vec weights = (tolerances.atol + tolerances.rtol.cwiseProduct(sizes)).cwiseInverse();
    const Vec error = (dt * K * (rk.b() - *rk.bhat())).cwiseProduct(weights);
    for (int k = 0; k < 2; ++k) {
      CHECK(std::fabs(out.x[k] - end[k]) < 1e-14);
      CHECK(std::fabs(out.xdot[k] - slope[k]) < 1e-13);
      CHECK(std::fabs(out.scaled[k] - error[k]) < 1e-15 * weights[k]);
    }
    CHECK(out.sum == doctest::Approx(error.squaredNorm()).epsilon(1e-9));
    CHECK(out.largest == 0);     // below nine unknowns it cannot decide
    CHECK(out.second_sum == 0);  // no second embedded method
    CHECK(out.second_largest == 0);
    const Vec change = end - at, slopes = slope - K.col(g);
    CHECK(out.change == doctest::Approx(change.cwiseProduct(weights).squaredNorm()).epsilon(1e-6));
    CHECK(out.slope_change == doctest::Approx(slopes.cwiseProduct(weights).squaredNorm()).epsilon(1e-6));
  }
}

TEST_CASE("explicit code: none where the system refuses more executable memory, now and later") {
  REQUIRE_CODE(1);
  check_without_code([] {
    const ProblemPtr p = problem(forced());
    const TableauPtr method = drawn("0 | \n 1/2 | 1/2 \n | 0 1 \n | 1 0");
    const Tolerances tolerances = Tolerances::uniform(2, 1e-6, 1e-6);
    for (int k = 0; k < 2; ++k)
      if (CompiledExplicitStep::make(*p, *method, {}, tolerances)) return 1;
    return 0;
  });
}

}  // namespace pendula::explicit_step_test
