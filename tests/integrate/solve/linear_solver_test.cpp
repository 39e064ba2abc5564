// Dense, straight-line and KLU: one solution, whichever factorisation is taken, and
// pivots that are chosen again.
#include "integrate/solve/linear_solver.hpp"

#include <random>

#include <doctest/doctest.h>

#include "base/decompositions.hpp"
#include "base/math.hpp"
#include "tests/integrate/solve/scalars.hpp"
#include "tests/require_code.hpp"

namespace pendula::linear_solver_test {

using namespace pendula::integrate;
using pendula::test::number;

namespace {

template <class Scalar>
struct System {
  int n;
  std::vector<Position> positions;
  std::vector<Scalar> values;
};

/// Diagonal, and other entries with this probability.
template <class Scalar>
System<Scalar> random_system(int n, double density, std::mt19937& random) {
  std::uniform_real_distribution<> u(-1, 1);
  System<Scalar> s{n, {}, {}};
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      if (i != j && u(random) * 0.5 + 0.5 > density) continue;
      s.positions.push_back({i, j});
      s.values.push_back(number<Scalar>(u(random) + (i == j ? 4 : 0), u(random)));
    }
  return s;
}

/// max |A x - b| / (‖A‖ ‖x‖) with b = (1, …, 1).
template <class Scalar>
double backward_error(const System<Scalar>& s, LinearSolver<Scalar>& solver) {
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  Vector x = Vector::Ones(s.n), r = -Vector::Ones(s.n);
  Vec rows = Vec::Zero(s.n);
  solver.solve(x.data());
  for (std::size_t k = 0; k < s.positions.size(); ++k) {
    r[s.positions[k].row] += s.values[k] * x[s.positions[k].column];
    rows[s.positions[k].row] += std::abs(s.values[k]);
  }
  return r.cwiseAbs().maxCoeff() / (rows.maxCoeff() * x.cwiseAbs().maxCoeff());
}

template <class Scalar>
void check_roads() {
  using Factorisation = typename LinearSolver<Scalar>::Factorisation;
  std::mt19937 random(3);
  for (int n : {1, 2, 5, 12, 39, 41, 70, 130})
    for (double density : {0.05, 0.35, 1.0})
      for (Factorisation factorisation :
           {Factorisation::chosen, Factorisation::dense, Factorisation::straight, Factorisation::sparse}) {
        CAPTURE(n);
        CAPTURE(density);
        const auto s = random_system<Scalar>(n, density, random);
        LinearSolver<Scalar> solver;
        solver.analyse(n, s.positions, factorisation);
        for (int k = 0; k < 3; ++k) {
          REQUIRE(solver.factorise(s.values.data()));
          CHECK(backward_error(s, solver) < 1e-13 * n);
        }
        CHECK(solver.weakest_pivot() > 0);
      }
}

}  // namespace

TEST_CASE("linear solver: all roads solve, real and complex, sparse and full") {
  check_roads<double>();
  check_roads<std::complex<double>>();
}

TEST_CASE(
    "linear solver: a system that is factorised often gets code; other pivots, the first factorisation and new code") {
  REQUIRE_CODE(1);
  std::mt19937 random(8);
  auto s = random_system<double>(12, 0.2, random);
  for (int i = 0; i < 12; ++i) s.positions.push_back({i, (i + 5) % 12}), s.values.push_back(0);
  LinearSolver<double> solver;
  solver.analyse(12, s.positions);
  int before = 0;
  for (; before < 100 && !solver.straight(); ++before) REQUIRE(solver.factorise(s.values.data()));
  CHECK(before > 1);
  REQUIRE(solver.straight());
  const auto pivots = solver.straight()->pivots();
  // The diagonal all but vanishes, a permutation takes its place: what was a good pivot is none any more.
  for (std::size_t k = 0; k < s.values.size(); ++k)
    if (s.positions[k].row == s.positions[k].column) s.values[k] *= 1e-9;
  for (std::size_t k = s.values.size() - 12; k < s.values.size(); ++k) s.values[k] = 3;
  REQUIRE(solver.factorise(s.values.data()));
  CHECK(solver.straight() == nullptr);  // the growth check has fired, the dense factorisation has solved
  CHECK(backward_error(s, solver) < 1e-13);
  for (int k = 0; k < 200 && !solver.straight(); ++k) REQUIRE(solver.factorise(s.values.data()));
  REQUIRE(solver.straight());  // pivots were chosen again
  CHECK(solver.straight()->pivots() != pivots);
  CHECK(backward_error(s, solver) < 1e-12);
}

TEST_CASE("linear solver: singular and undefined matrices are refused on every factorisation") {
  using Factorisation = LinearSolver<double>::Factorisation;
  for (Factorisation factorisation :
       {Factorisation::chosen, Factorisation::dense, Factorisation::straight, Factorisation::sparse}) {
    LinearSolver<double> solver;
    solver.analyse(3, {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, 2}}, factorisation);
    const double good[] = {2, 1, 1, 3, 1}, singular[] = {0, 0, 1, 3, 1}, undefined[] = {1, NAN, 1, 2, 1};
    CHECK(solver.factorise(good));
    CHECK(!solver.factorise(singular));
    CHECK(!solver.factorise(undefined));
    CHECK(solver.factorise(good));
  }
}

TEST_CASE("linear solver: units of unknowns do not make a matrix singular") {
  using Factorisation = LinearSolver<double>::Factorisation;
  const double c[] = {1, 1e-20, 1e-38}, given[] = {2, 1, 1, 1, 3, 1, 1, 1, 4};
  std::vector<Position> positions;
  std::vector<double> values;
  double b[] = {0, 0, 0};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      positions.push_back({i, j});
      values.push_back(given[3 * i + j] * c[j]);
      b[i] += given[3 * i + j];  // the solution is 1/c
    }
  for (Factorisation factorisation : {Factorisation::chosen, Factorisation::dense, Factorisation::band}) {
    LinearSolver<double> solver;
    solver.analyse(3, positions, factorisation);
    REQUIRE(solver.factorise(values.data()));
    double w[] = {b[0], b[1], b[2]}, log = 0;
    solver.solve(w);
    for (int j = 0; j < 3; ++j) CHECK(w[j] * c[j] == doctest::Approx(1).epsilon(1e-14));
    CHECK(solver.determinant(log) == 1);
    CHECK(log == doctest::Approx(std::log(17.0 * 1e-20 * 1e-38)));  // 2·11 - 1·3 + 1·(-2)
    REQUIRE(solver.factorise(given));                               // other units, the same solver
    double again[] = {b[0], b[1], b[2]};
    solver.solve(again);
    for (double v : again) CHECK(v == doctest::Approx(1).epsilon(1e-14));
  }
}

TEST_CASE("linear solver: what earlier runs factorised counts towards code") {
  std::mt19937 random(5);
  System<double> s{90, {}, {}};
  for (int i = 0; i < s.n; ++i)
    for (int j = std::max(0, i - 2); j < std::min(s.n, i + 2); ++j) {
      s.positions.push_back({i, j});
      s.values.push_back(i == j ? 4 : 1 + 0.1 * static_cast<double>(random() % 10));
    }
  int with_code = 0;
  for (int run = 0; run < 20; ++run) {  // 90 factorisations each, of 1500: no run would be long enough
    LinearSolver<double> solver;
    solver.analyse(s.n, s.positions);
    for (int k = 0; k < 90; ++k) REQUIRE(solver.factorise(s.values.data()));
    CHECK(backward_error(s, solver) < 1e-15);
    if (run < 16) CHECK(solver.straight() == nullptr);
    with_code += solver.straight() != nullptr;
  }
  CHECK(with_code >= 2);
}

}  // namespace pendula::linear_solver_test
