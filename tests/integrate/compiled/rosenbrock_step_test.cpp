// A Rosenbrock step as one program against the definition of the method and against dense linear algebra.
#include <random>

#include <doctest/doctest.h>

#include "base/decompositions.hpp"
#include "dae/model/first_order.hpp"
#include "integrate/compiled/rosenbrock_step.hpp"
#include "integrate/solve/linear_solver.hpp"
#include "tests/integrate/problems.hpp"
#include "tests/require_code.hpp"

namespace pendula::rosenbrock_step_test {

using namespace pendula::test;
using namespace pendula::integrate;

namespace {

std::mt19937 random_numbers(3);

Vec random_vector(int n) {
  std::uniform_real_distribution<double> u(-1, 1);
  return Vec::NullaryExpr(n, [&] { return u(random_numbers); });
}

/// Verwer's ROS2, γ = 1 - 1/√2, with the linearly implicit Euler method embedded.
Rosenbrock ros2() {
  const double gamma = 1 - std::sqrt(0.5);
  RosenbrockData data;
  data.gamma = Expr(gamma);
  data.A = data.C = MatX::Zero(2, 2);
  data.A(1, 0) = Expr(1 / gamma), data.C(1, 0) = Expr(-2 / gamma);
  data.m = VecX(2), data.m << Expr(1.5 / gamma), Expr(0.5 / gamma);
  data.mhat = VecX(2), *data.mhat << Expr(1 / gamma), Expr(0);
  data.dense = MatX(2, 2);
  data.dense << Expr(0.3), Expr(-0.2), Expr(0.7), Expr(0.1);
  return Rosenbrock(data);
}

dae::FirstOrder forced() {
  const Expr t = time_symbol(), x = variable("x"), y = variable("y");
  return ode({x, y}, {y * cos(x) + sin(3 * t), -x * x * y + exp(-t) / (2 + sin(3 * t))});
}

/// A point, its matrices, and the code for a step from there.
struct Bench {
  ProblemPtr p;
  Rosenbrock method = ros2();
  int n, m, N;
  double dt = 0.05;
  Point from;
  Mat M, J;  ///< ∂F/∂x′ (with zero columns for z), ∂F/∂(x, z)
  Tolerances tolerances;
  std::vector<char> in_mass;
  LinearSolver<double> solver;
  std::shared_ptr<CompiledRosenbrockStep> code;

  explicit Bench(const dae::FirstOrder& model)
      : p(problem(model)), n(p->n()), m(p->m()), N(n + m), tolerances(Tolerances::uniform(N, 1e-3, 1e-4)) {
    from = {0.3, random_vector(n), random_vector(n), random_vector(m)};
    p->set_point(from.t, from.x.data(), from.xdot.data(), from.z.data());
    M = J = Mat::Zero(N, N);
    std::vector<Position> positions;
    std::vector<double> values;
    for (std::size_t k = 0; k < p->pattern().size(); ++k) {
      const auto [row, column] = p->pattern()[k];
      const double entry = p->jacobian()[k];
      in_mass.push_back(column >= n && column < 2 * n);
      positions.push_back({row, column < n ? column : column - n});
      (in_mass.back() ? M : J)(row, positions.back().column) += entry;
      values.push_back(in_mass.back() ? entry / (method.gamma() * dt) : entry);
    }
    solver.analyse(N, positions);
    solver.prepare(values.data());
    REQUIRE(solver.factorise(values.data()));
    code = CompiledRosenbrockStep::make({*p, method, in_mass, *solver.straight(), tolerances});
    REQUIRE(code);
  }
  Vec y() const {
    Vec all(N);
    all << from.x, from.z;
    return all;
  }
  Vec F(double t, const Vec& at, const Vec& xdot) {
    const Vec x = at.head(n), z = at.tail(m);
    Vec result(N);
    p->set_point(t, x.data(), xdot.data(), z.data());
    p->residual(result.data());
    return result;
  }
  /// ∂F/∂t by a difference of fourth order.
  Vec slope() {
    const double d = 1e-3;
    const Vec rest = Vec::Zero(n);
    const auto at = [&](double t) { return F(from.t + t, y(), rest); };
    return (8 * (at(d) - at(-d)) - (at(2 * d) - at(-2 * d))) / (12 * d);
  }
};

double distance(const double* a, const Vec& b) {
  return (Eigen::Map<const Vec>(a, b.size()) - b).cwiseAbs().maxCoeff() / (1 + b.cwiseAbs().maxCoeff());
}

}  // namespace

TEST_CASE("rosenbrock code: a step is the one that the definition gives") {
  REQUIRE_CODE(1);
  for (int run = 0; run < 10; ++run) {
    Bench b(forced());
    const Mat inverse = (Mat::Identity(2, 2) + b.method.gamma() * b.dt * b.J).inverse();  // J = -∂f/∂x
    const auto f = [&](double t, const Vec& x) { return Vec(-b.F(t, x, Vec::Zero(2))); };
    const Vec ft = -b.slope();
    Mat k(2, 2);
    for (int i = 0; i < 2; ++i) {
      Vec x = b.from.x, sum = Vec::Zero(2);
      for (int j = 0; j < i; ++j)
        x += b.method.alpha_matrix()(i, j) * k.col(j), sum += b.method.gamma_matrix()(i, j) * k.col(j);
      k.col(i) = inverse * (b.dt * f(b.from.t + b.method.alpha()[i] * b.dt, x) - b.dt * b.J * sum +
                            b.method.gammas()[i] * b.dt * b.dt * ft);
    }
    const Vec x1 = b.from.x + k * b.method.b();
    const auto end = b.code->run(*b.p, b.from, b.dt, nullptr);
    CHECK(end.regular);
    CHECK(distance(end.y, x1) < 1e-11);  // the difference for ∂f/∂t
    CHECK(distance(end.xdot, f(b.from.t + b.dt, x1)) < 1e-11);
  }
}

TEST_CASE("rosenbrock code: a semi-explicit DAE, error estimate and dense output") {
  REQUIRE_CODE(1);
  for (int run = 0; run < 10; ++run) {
    Bench b(pendulum3d_semi_explicit());
    const auto lu = (b.M / (b.method.gamma() * b.dt) + b.J).partialPivLu();
    Mat U = Mat::Zero(b.N, 2);
    for (int i = 0; i < 2; ++i)
      U.col(i) = lu.solve(Vec(-b.F(b.from.t, b.y() + U * b.method.A().row(i).transpose(),
                                   (-U * b.method.C().row(i).transpose() / b.dt).head(b.n))));
    const Vec y1 = b.y() + U * b.method.m(), error = U * *b.method.e();
    const Vec scale = 1e-4 + 1e-3 * b.y().cwiseAbs().cwiseMax(y1.cwiseAbs()).array();
    const auto end = b.code->run(*b.p, b.from, b.dt, nullptr);
    CHECK(distance(end.y, y1) < 1e-12);
    CHECK(distance(end.scaled, error.cwiseQuotient(scale)) < 1e-11);
    CHECK(end.sum == doctest::Approx(error.cwiseQuotient(scale).squaredNorm()).epsilon(1e-10));
    CHECK(end.largest == doctest::Approx(error.cwiseQuotient(scale).cwiseAbs2().maxCoeff()).epsilon(1e-10));
    for (int r = 0; r < 2; ++r)
      CHECK(distance(end.dense + r * b.N, U * b.method.dense().row(r).transpose()) < 1e-12);
    const Vec xdot = Eigen::Map<const Vec>(end.xdot, b.n);
    CHECK(b.F(b.from.t + b.dt, y1, xdot).head(b.n).cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("rosenbrock code: pivots that do not suit are noticed") {
  REQUIRE_CODE(1);
  Bench b(pendulum3d_semi_explicit());
  b.from.x.head(3).setZero();  // the multiplier's pivot is |p|²
  CHECK_FALSE(b.code->run(*b.p, b.from, b.dt, nullptr).regular);
  b.from.x[0] = NAN;
  CHECK_FALSE(b.code->run(*b.p, b.from, b.dt, nullptr).regular);
}

}  // namespace pendula::rosenbrock_step_test
