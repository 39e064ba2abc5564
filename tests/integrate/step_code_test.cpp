// Whole steps as machine code against the same steps by loops.
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "base/decompositions.hpp"
#include "integrate/collocation.hpp"
#include "integrate/step_code.hpp"
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

Point random_point(int n, int m, std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  Point p = start(Vec::NullaryExpr(n, [&] { return u(random); }));
  p.t = 0.3;
  p.xdot = Vec::NullaryExpr(n, [&] { return u(random); });
  p.z = Vec::NullaryExpr(m, [&] { return u(random); });
  return p;
}

}  // namespace

TEST_CASE("step code: the stages of an explicit method") {
  if (!codegen::Machine::available()) return;
  const TableauPtr method =
      drawn("0 | \n 1/2 | 1/2 \n 1/2 | 0 1/2 \n 1 | 0 0 1 \n | 1/6 1/3 1/3 1/6 \n | 0 1 0 0");
  const ProblemPtr p = problem(forced());
  const Tableau& rk = *method;
  const auto code = ExplicitCode::make(*p, rk);
  REQUIRE(code);
  std::mt19937 random(1);
  for (int run = 0; run < 20; ++run) {
    const Point from = random_point(2, 0, random);
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

TEST_CASE("step code: a Newton iteration solves (W/h ⊗ M + I ⊗ J) ΔZ = -R") {
  if (!codegen::Machine::available()) return;
  const dae::FirstOrder model = pendulum3d();
  const ProblemPtr p = problem(model);
  const int n = p->n(), m = p->m(), N = n + m;
  std::mt19937 random(2);
  for (int s : {2, 3, 5}) {
    const IrkFormula formula(share(s == 2 ? gauss(2) : radau(s)));
    const double dt = 0.05;
    const Point at = random_point(n, m, random);
    p->place(at.t, at.x.data(), at.xdot.data(), at.z.data());
    Mat M = Mat::Zero(N, N), J = Mat::Zero(N, N);
    std::vector<Position> positions;
    std::vector<bool> mass;
    const std::vector<double> entries = p->jacobian();
    for (std::size_t k = 0; k < entries.size(); ++k) {
      const auto [row, column] = p->pattern()[k];
      mass.push_back(column >= n && column < 2 * n);
      positions.push_back({row, column < n ? column : column - n});
      (mass.back() ? M : J)(row, positions.back().column) += entries[k];
    }
    const auto shifted = [&](auto factor) {
      std::vector<decltype(factor)> list;
      for (std::size_t k = 0; k < entries.size(); ++k)
        list.push_back(mass[k] ? factor * entries[k] : entries[k]);
      return list;
    };
    LinearSolver<double> real;
    std::vector<LinearSolver<std::complex<double>>> complex(formula.pairs.size());
    const codegen::StraightLU* real_code = nullptr;
    if (formula.has_real) {
      real.analyse(N, positions);
      const auto values = shifted(formula.gamma / dt);
      real.prepare(values.data());
      REQUIRE(real.factorise(values.data()));
      real_code = real.straight();
    }
    NewtonCode::Complex pairs;
    for (std::size_t k = 0; k < complex.size(); ++k) {
      complex[k].analyse(N, positions);
      const auto values = shifted(formula.pairs[k] / dt);
      complex[k].prepare(values.data());
      REQUIRE(complex[k].factorise(values.data()));
      pairs.push_back(complex[k].straight());
    }
    const auto code = NewtonCode::make(*p, formula, real_code, pairs, 0, true);
    REQUIRE(code);
    CHECK(code->suits(real_code, pairs));
    code->set_factors(real_code, pairs);
    Vec y(N);
    y << at.x, at.z;
    const Vec scale = Vec::LinSpaced(N, 0.5, 2), Z = 0.1 * random_point(N * s, 0, random).x;
    code->begin(*p, at.t, dt, y.data(), scale.data());
    std::vector<double> moved(Z.begin(), Z.end());
    double sum = 0, largest = 0;
    code->iterate(moved, sum, largest);

    Mat whole = Mat::Zero(s * N, s * N);
    Vec R(s * N);
    for (int i = 0; i < s; ++i) {
      Vec slope = Vec::Zero(n);
      for (int j = 0; j < s; ++j) {
        whole.block(i * N, j * N, N, N) = formula.W(i, j) / dt * M + (i == j ? J : Mat::Zero(N, N));
        slope += formula.W(i, j) / dt * Z.segment(j * N, n);
      }
      const Vec stage = y + Z.segment(i * N, N), x = stage.head(n), z = stage.tail(m);
      p->place(at.t + formula.c[static_cast<std::size_t>(i)] * dt, x.data(), slope.data(), z.data());
      p->residual(R.data() + i * N);
    }
    const Vec step = -whole.partialPivLu().solve(R);
    double squares = 0, most = 0;
    for (int k = 0; k < s * N; ++k) {
      CHECK(std::fabs(moved[static_cast<std::size_t>(k)] - Z[k] - step[k]) <
            1e-10 * (1 + step.cwiseAbs().maxCoeff()));
      const double scaled = step[k] / scale[k % N];
      squares += scaled * scaled, most = std::max(most, scaled * scaled);
    }
    CHECK(sum == doctest::Approx(squares).epsilon(1e-9));
    CHECK(largest == doctest::Approx(most).epsilon(1e-9));
  }
}
