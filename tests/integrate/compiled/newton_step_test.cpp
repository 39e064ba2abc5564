// The steps of fully implicit methods as machine code against dense linear algebra.
#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "base/decompositions.hpp"
#include "dae/model/first_order.hpp"
#include "integrate/compiled/newton_step.hpp"
#include "integrate/solve/linear_solver.hpp"
#include "method/collocation.hpp"
#include "tests/integrate/problems.hpp"

namespace pendula::newton_step_test {

using namespace pendula::test;
using namespace pendula::integrate;

namespace {

std::mt19937 random_numbers(2);

Vec random_vector(int n) {
  std::uniform_real_distribution<double> u(-1, 1);
  return Vec::NullaryExpr(n, [&] { return u(random_numbers); });
}

/// x′ with a coefficient that depends on x.
dae::FirstOrder quasilinear() {
  const Expr x = variable("x"), y = variable("y"), t = time_symbol();
  dae::FirstOrder model = ode({x, y}, {-y, x});
  model.F = {(2 + cos(x)) * model.xdot[0] + y * model.xdot[1] - sin(t), model.xdot[1] + x * y};
  return hidden(model);
}

/// A model, a point, and what the step of a method from there needs.
struct Bench {
  ProblemPtr p;
  IrkFormula formula;
  int n, m, N, s;
  double t = 0.3, dt = 0.05;
  Vec y, scale, Z;
  Mat M, J;  ///< ∂F/∂x′ (with zero columns for z), ∂F/∂(x, z)
  std::vector<double> entries;
  std::vector<Position> positions;
  std::vector<char> in_mass, bare;
  LinearSolver<double> real;
  std::shared_ptr<CompiledNewtonStep> code;

  Bench(const dae::FirstOrder& model, const Tableau& rk)
      : p(problem(model)), formula(share(rk)), n(p->n()), m(p->m()), N(n + m), s(formula.s) {
    const Vec x = random_vector(n), xdot = random_vector(n), z = random_vector(m);
    y.resize(N), y << x, z;
    scale = Vec::LinSpaced(N, 0.5, 2), Z = 0.1 * random_vector(N * s);
    p->set_point(t, x.data(), xdot.data(), z.data());
    entries = p->jacobian();
    M = J = Mat::Zero(N, N);
    for (std::size_t k = 0; k < entries.size(); ++k) {
      const auto [row, column] = p->pattern()[k];
      in_mass.push_back(column >= n && column < 2 * n);
      positions.push_back({row, column < n ? column : column - n});
      (in_mass.back() ? M : J)(row, positions.back().column) += entries[k];
    }
    bare.assign(static_cast<std::size_t>(N), 0);
    bare.back() = 1;
    prepare(real, formula.gamma / dt);
    REQUIRE(real.straight());
    code = CompiledNewtonStep::make({*p, formula, bare, in_mass, *real.straight()}, 0, true);
    REQUIRE(code);
    REQUIRE(code->factorise(entries, dt));
    code->begin(*p, t, dt, y.data(), scale.data());
    code->set(Z.data());
  }

  void prepare(LinearSolver<double>& solver, double factor) {
    std::vector<double> values;
    for (std::size_t k = 0; k < entries.size(); ++k)
      values.push_back(in_mass[k] ? factor * entries[k] : entries[k]);
    solver.analyse(N, positions);
    solver.prepare(values.data());
    REQUIRE(solver.factorise(values.data()));
  }
  Vec F(double at, const Vec& state, const Vec& xdot) {
    const Vec x = state.head(n), z = state.tail(m);
    Vec result(N);
    p->set_point(at, x.data(), xdot.data(), z.data());
    p->residual(result.data());
    return result;
  }
  /// Σ factorsⱼ Zⱼ
  Vec mixed(const Vec& factors) const {
    Vec sum = Vec::Zero(N);
    for (int j = 0; j < s; ++j) sum += factors[j] * Z.segment(j * N, N);
    return sum;
  }
};

std::vector<Bench> benches() {
  std::vector<Bench> list;
  // Two methods with the same nodes: programs are remembered, and must not be taken for each other.
  const TableauPtr two[] = {drawn("1/3 | 5/12 -1/12 \n 1 | 3/4 1/4 \n | 3/4 1/4"),
                            drawn("1/3 | 1/2 -1/6 \n 1 | 1/2 1/2 \n | 3/4 1/4")};
  for (const dae::FirstOrder& model : {pendulum3d(), quasilinear()})
    for (const TableauPtr& rk : two) list.emplace_back(model, *rk);
  for (const dae::FirstOrder& model : {pendulum3d(), quasilinear()})
    for (const Tableau& rk : {gauss(2), radau(3), radau(5), gauss(6), radau(7)}) list.emplace_back(model, rk);
  return list;
}

double distance(const double* a, const Vec& b) {
  return (Eigen::Map<const Vec>(a, b.size()) - b).cwiseAbs().maxCoeff() / (1 + b.cwiseAbs().maxCoeff());
}

}  // namespace

TEST_CASE("newton code: an iteration solves (W/h ⊗ M + I ⊗ J) ΔZ = -R") {
  if (codegen::Machine::widest() == 1) return;
  for (Bench& b : benches()) {
    Mat whole = Mat::Zero(b.s * b.N, b.s * b.N);
    Vec R(b.s * b.N);
    for (int i = 0; i < b.s; ++i) {
      const Vec slope = b.mixed(b.formula.W.row(i)).head(b.n) / b.dt;
      for (int j = 0; j < b.s; ++j)
        whole.block(i * b.N, j * b.N, b.N, b.N) =
            b.formula.W(i, j) / b.dt * b.M + (i == j ? b.J : Mat::Zero(b.N, b.N));
      R.segment(i * b.N, b.N) = b.F(b.t + b.formula.c[i] * b.dt, b.y + b.Z.segment(i * b.N, b.N), slope);
    }
    const Vec solved = whole.partialPivLu().solve(R), step = -solved;
    double sum = 0, largest = 0;
    b.code->iterate(sum, largest);
    CHECK(distance(b.code->end().Z, b.Z + step) < 1e-10);  // condition of the matrix: 1e4
    const Vec squares = step.cwiseQuotient(b.scale.replicate(b.s, 1)).cwiseAbs2();
    CHECK(sum == doctest::Approx(squares.sum()).epsilon(1e-9));
    CHECK(largest == doctest::Approx(squares.maxCoeff()).epsilon(1e-9));
  }
}

TEST_CASE("newton code: the end of a step") {
  if (codegen::Machine::widest() == 1) return;
  for (Bench& b : benches()) {
    const auto end = b.code->end();
    Vec slopes(b.s + 1);
    b.formula.lagrange_slopes(1, slopes.data());
    CHECK(distance(end.y, b.y + b.mixed(b.formula.end)) < 1e-14);
    CHECK(distance(end.xdot, b.mixed(slopes.tail(b.s)).head(b.n) / b.dt) < 1e-12);
    const auto error_at = [&](const Vec& y) {
      Vec F = b.F(b.t, y, -b.mixed(b.formula.error).head(b.n) / b.dt);
      F[b.N - 1] = 0;  // the bare row
      const Mat A = b.formula.gamma / b.dt * b.M + b.J;
      return Vec(A.partialPivLu().solve(Vec(-F)));
    };
    CHECK(distance(end.error, error_at(b.y)) < 1e-10);
    CHECK(end.sum == doctest::Approx(error_at(b.y).cwiseQuotient(b.scale).squaredNorm()).epsilon(1e-9));
    const Vec moved = b.y + random_vector(b.N);
    CHECK(distance(b.code->end_at(moved.data()).error, error_at(moved)) < 1e-10);
    CHECK(distance(b.code->end().error, error_at(b.y)) < 1e-10);  // and y is as before
  }
}

TEST_CASE("newton code: starting values continue the polynomial of the last step") {
  if (codegen::Machine::widest() == 1) return;
  for (Bench& b : benches()) {
    const Vec before = b.y + random_vector(b.N);
    const double ratio = 1.3;
    b.code->predict(ratio, before.data(), b.Z.data());
    const auto end = b.code->end();
    for (int i = 0; i < b.s; ++i) {
      Vec l(b.s + 1);
      b.formula.lagrange(1 + b.formula.c[i] * ratio, l.data());
      CHECK(distance(end.Z + i * b.N, before - b.y + b.mixed(l.tail(b.s))) < 1e-12);
    }
  }
}

TEST_CASE("newton code: pivots that do not serve are noticed") {
  if (codegen::Machine::widest() == 1) return;
  for (Bench& b : benches()) {
    std::vector<double> entries = b.entries;
    for (std::size_t k = 0; k < entries.size(); ++k)
      if (b.positions[k].row == 0) entries[k] = 0;
    CHECK_FALSE(b.code->factorise(entries, b.dt));
    entries = b.entries;
    entries[0] = NAN;
    CHECK_FALSE(b.code->factorise(entries, b.dt));
    CHECK(b.code->factorise(b.entries, b.dt));
  }
}

}  // namespace pendula::newton_step_test
