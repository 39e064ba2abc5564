// Newton's method: when it says converged, and what it says otherwise.
#include "integrate/solve/newton.hpp"

#include <cmath>
#include <functional>

#include <doctest/doctest.h>

namespace pendula::newton_test {

using namespace pendula::integrate;

namespace {

/// r(w) given with its Jacobian and the size of the terms without w.
struct System : Equations {
  std::function<Vec(const Vec&)> r;
  std::function<Mat(const Vec&)> J;
  Vec constant;
  void residual(const Vec& w, Vec& out) override { out = r(w); }
  void jacobian(const Vec& w, Mat& out, Vec& size) override { out = J(w), size = constant; }
};

System scalar(std::function<double(double)> r, std::function<double(double)> slope, double constant = 0) {
  System s;
  s.r = [r](const Vec& w) { return Vec::Constant(1, r(w[0])); };
  s.J = [slope](const Vec& w) { return Mat::Constant(1, 1, slope(w[0])); };
  s.constant = Vec::Constant(1, constant);
  return s;
}

}  // namespace

TEST_CASE("newton: a linear system takes one iteration whatever its units") {
  System s;
  Mat A(3, 3);
  A << 2e12, 1e3, 0, 1, 3e-9, 1e-20, 0, 1e-15, 4e-26;  // rows and columns differ by 10³⁰
  const Vec exact = (Vec(3) << 1e-6, 2e3, -5e13).finished();
  const Vec b = A * exact;
  s.r = [&](const Vec& w) { return Vec(A * w - b); };
  s.J = [&](const Vec&) { return A; };
  s.constant = b.cwiseAbs();
  Vec w = Vec::Zero(3);
  const NewtonResult result = Newton().solve(s, w);
  CHECK(result.outcome == Outcome::converged);
  CHECK(result.iterations == 1);
  // Relative error: condition of the scaled matrix (below 10) times a few ε.
  CHECK((w - exact).cwiseQuotient(exact).cwiseAbs().maxCoeff() <= 1e-14);
}

TEST_CASE("newton: damping saves starts from which full steps diverge") {
  System s = scalar([](double w) { return std::atan(w); }, [](double w) { return 1 / (1 + w * w); });
  Vec w = Vec::Constant(1, 20.0);
  CHECK(Newton().solve(s, w).ok());
  CHECK(std::fabs(w[0]) <= 1e-15);
  // Outside the domain r is NaN: the step is shortened until it is not.
  System root = scalar([](double x) { return std::log(x); }, [](double x) { return 1 / x; });
  w[0] = 10;
  CHECK(Newton().solve(root, w).ok());
  CHECK(std::fabs(w[0] - 1) <= 1e-15);
}

TEST_CASE("newton: refuses what has no solution, what is singular, what is not a number") {
  Vec w = Vec::Constant(1, 1.0);
  System none = scalar([](double x) { return x * x + 1; }, [](double x) { return 2 * x; }, 1);
  CHECK_FALSE(Newton().solve(none, w).ok());
  CHECK(w.allFinite());
  System flat = scalar([](double) { return 1.0; }, [](double) { return 0.0; });
  CHECK(Newton().solve(flat, w).outcome == Outcome::singular);
  System undefined = scalar([](double) { return std::nan(""); }, [](double) { return 1.0; });
  CHECK(Newton().solve(undefined, w).outcome == Outcome::not_finite);
  System bad_slope = scalar([](double x) { return x - 2; }, [](double) { return std::nan(""); });
  CHECK(Newton().solve(bad_slope, w).ok() == false);
}

TEST_CASE("newton: a double root converges linearly and is accepted at the rounding level") {
  System s = scalar([](double x) { return x * x - 2 * x + 1; }, [](double x) { return 2 * x - 2; }, 1);
  Vec w = Vec::Constant(1, 3.0);
  const NewtonResult result = Newton().solve(s, w);
  // |x - 1|² below 32 ε of terms of size 4: √(128 ε).
  CHECK(std::fabs(w[0] - 1) <= 2e-7);
  CHECK(result.iterations >= 20);  // halves the error each time
}

TEST_CASE("newton: null vectors point at the dependent unknowns") {
  Mat J(3, 3);
  J << 1, 0, 0, 0, 1e6, 2e3, 0, 2e-3, 4e-6;
  CHECK_FALSE(ScaledLU().factorise(J));
  Vec right, left;
  ScaledLU::null_vectors(J, right, left);
  CHECK(std::fabs(right[0]) <= 1e-15);
  CHECK(std::fabs(right[1]) >= 0.1);
  CHECK(std::fabs(right[2]) >= 0.1);
  CHECK(std::fabs(left[0]) <= 1e-15);
}

}  // namespace pendula::newton_test
