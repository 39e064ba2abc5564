// Straight-line LU against Eigen's dense LU, on random patterns, bad scales, and matrices it must refuse.
#include <doctest/doctest.h>

#include <complex>
#include <random>

#include "base/decompositions.hpp"
#include "base/math.hpp"
#include "codegen/linear/straight_lu.hpp"
#include "tests/require_code.hpp"

namespace pendula::straight_lu_test {

using codegen::StraightLU;
using Positions = std::vector<StraightLU::Position>;

namespace {

struct Sample {
  Positions positions;
  std::vector<double> values;  // pairs if complex
};

/// A random pattern with a nonzero permuted diagonal; structural zeros on the main diagonal are welcome.
Sample sample(int n, double density, bool complex, std::mt19937& random) {
  std::uniform_real_distribution<> u(-1, 1);
  std::vector<int> permutation(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) permutation[i] = i;
  std::shuffle(permutation.begin(), permutation.end(), random);
  Sample s;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const bool must = permutation[i] == j;
      if (!must && u(random) * 0.5 + 0.5 > density) continue;
      s.positions.push_back({i, j});
      for (int k = 0; k < (complex ? 2 : 1); ++k) s.values.push_back(u(random) + (must ? 1.5 : 0));
    }
  s.positions.push_back(s.positions.front());  // an entry in two parts
  for (int k = 0; k < (complex ? 2 : 1); ++k) s.values.push_back(0.25);
  return s;
}

Eigen::MatrixXcd dense(int n, const Sample& s, bool complex) {
  Eigen::MatrixXcd A = Eigen::MatrixXcd::Zero(n, n);
  for (std::size_t p = 0; p < s.positions.size(); ++p)
    A(s.positions[p].row, s.positions[p].column) +=
        complex ? std::complex<double>(s.values[2 * p], s.values[2 * p + 1]) : s.values[p];
  return A;
}

/// ‖A x - b‖ / (‖A‖ ‖x‖), infinity norms: the backward error.
double backward_error(int n, const Sample& s, bool complex, StraightLU& lu, std::mt19937& random) {
  std::uniform_real_distribution<> u(-1, 1);
  std::vector<double> b(static_cast<std::size_t>(n * (complex ? 2 : 1)));
  for (double& v : b) v = u(random);
  const std::vector<double> right = b;
  lu.solve(b.data());
  const auto vector = [&](const std::vector<double>& v) {
    Eigen::VectorXcd x(n);
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      x[i] = complex ? std::complex<double>(v[2 * k], v[2 * k + 1]) : v[k];
    }
    return x;
  };
  const Eigen::MatrixXcd A = dense(n, s, complex);
  const Eigen::VectorXcd x = vector(b), r = A * x - vector(right);
  return r.cwiseAbs().maxCoeff() / (A.cwiseAbs().rowwise().sum().maxCoeff() * x.cwiseAbs().maxCoeff());
}

}  // namespace

TEST_CASE("straight-line LU: random patterns, real and complex, backward error at rounding; new values too") {
  REQUIRE_CODE(1);
  std::mt19937 random(5);
  std::uniform_real_distribution<> u(0.8, 1.2);
  for (bool complex : {false, true})
    for (int n : {1, 2, 3, 7, 20, 60})
      for (double density : {0.0, 0.1, 0.6}) {
        Sample s = sample(n, density, complex, random);
        auto lu = StraightLU::plan(n, s.positions, s.values.data(), complex);
        // A random sparse matrix may be singular; then the dense LU must say so as well.
        if (!lu) {
          CHECK((Eigen::FullPivLU<Eigen::MatrixXcd>(dense(n, s, complex)).rank() < n || n == 60));
          continue;
        }
        REQUIRE(lu->factorise(s.values.data()));
        CHECK(backward_error(n, s, complex, *lu, random) < n * 1e-14);
        for (double& v : s.values) v *= u(random);
        if (lu->factorise(s.values.data())) CHECK(backward_error(n, s, complex, *lu, random) < n * 1e-12);
      }
}

TEST_CASE("straight-line LU: rows and columns of very different size") {
  REQUIRE_CODE(1);
  std::mt19937 random(11);
  Sample s = sample(12, 0.3, false, random);
  const Eigen::MatrixXd plain = dense(12, s, false).real();
  for (std::size_t p = 0; p < s.positions.size(); ++p)
    s.values[p] *= std::pow(10.0, (s.positions[p].row * 7 % 25) - 12) *
                   std::pow(10.0, (s.positions[p].column * 5 % 17) - 8);
  auto lu = StraightLU::plan(12, s.positions, s.values.data(), false);
  REQUIRE(lu);
  REQUIRE(lu->factorise(s.values.data()));
  std::vector<double> b(12);
  for (int i = 0; i < 12; ++i) b[i] = std::pow(10.0, (i * 7 % 25) - 12) * (1 + i);
  lu->solve(b.data());
  Eigen::VectorXd plain_right(12);
  for (int i = 0; i < 12; ++i) plain_right[i] = 1 + i;
  const Eigen::VectorXd x = plain.partialPivLu().solve(plain_right);
  for (int j = 0; j < 12; ++j)
    CHECK(b[j] * std::pow(10.0, (j * 5 % 17) - 8) == doctest::Approx(x[j]).epsilon(1e-9));
}

TEST_CASE("straight-line LU: refuses what its pivots do not suit, and singular or undefined matrices") {
  REQUIRE_CODE(1);
  const Positions full = {{0, 0}, {0, 1}, {1, 0}, {1, 1}};
  const double good[] = {2, 1, 1, 3}, singular[] = {1, 2, 2, 4}, swapped[] = {1e-9, 1, 1, 1e-9};
  const double undefined[] = {1, NAN, 1, 2};
  auto lu = StraightLU::plan(2, full, good, false);
  REQUIRE(lu);
  CHECK(lu->factorise(good));
  CHECK(!lu->factorise(swapped));  // the pivot of the plan is 10⁹ times too small
  CHECK(!lu->factorise(singular));
  CHECK(!lu->factorise(undefined));
  CHECK(lu->factorise(good));
  CHECK(lu->weakest_pivot() == doctest::Approx(2.5 / 3));  // rows scaled by 1/2 and 1/3; second pivot 3 - 1/2
  CHECK(!StraightLU::plan(2, full, singular, false));
  CHECK(!StraightLU::plan(2, full, undefined, false));
  CHECK(!StraightLU::plan(2, {{0, 0}, {1, 0}}, good, false));                     // a column without entries
  CHECK(!StraightLU::plan(2, {{1, 1}, {0, 1}, {1, 0}, {0, 0}}, good, false, 1));  // longer than allowed
}

TEST_CASE("straight-line LU: a plan judges every matrix by the sizes of its own rows") {
  REQUIRE_CODE(1);
  const Positions full = {{0, 0}, {0, 1}, {1, 0}, {1, 1}};
  // Planned where a row is 10¹⁰ long: γ/h at the first step of a run, then the same rows at its end.
  const double tiny_step[] = {1e10, 1, 1, 0.5}, good[] = {2, 1, 1, 3}, unsuited[] = {1e-7, 1, 1, 1};
  for (const bool complex : {false, true}) {
    const auto values = [&](const double* real) {
      std::vector<double> all;
      for (int k = 0; k < 4; ++k) {
        all.push_back(real[k]);
        if (complex) all.push_back(0);
      }
      return all;
    };
    auto lu = StraightLU::plan(2, full, values(tiny_step).data(), complex);
    REQUIRE(lu);
    REQUIRE(lu->factorise(values(good).data()));
    CHECK(lu->weakest_pivot() == doctest::Approx(2.5 / 3));
    CHECK(!lu->factorise(values(unsuited).data()));  // a multiplier of 10⁷ between rows of equal length
    auto other = StraightLU::plan(2, full, values(good).data(), complex);
    REQUIRE(other);
    REQUIRE(other->factorise(values(tiny_step).data()));
    CHECK(other->weakest_pivot() == doctest::Approx(0.5));
  }
}

namespace {

/// A matrix written out, with the entries that are not zero as its pattern.
Sample pattern_of(const Eigen::MatrixXcd& A, bool complex) {
  Sample s;
  for (int i = 0; i < A.rows(); ++i)
    for (int j = 0; j < A.cols(); ++j) {
      if (A(i, j) == 0.0) continue;
      s.positions.push_back({i, j});
      s.values.push_back(A(i, j).real());
      if (complex) s.values.push_back(A(i, j).imag());
    }
  return s;
}

Eigen::MatrixXcd random_matrix(int rows, int columns, bool complex, std::mt19937& random) {
  std::uniform_real_distribution<> u(-1, 1);
  return Eigen::MatrixXcd::NullaryExpr(rows, columns, [&] {
    const double re = u(random), im = u(random);
    return std::complex<double>(re, complex ? im : 0);
  });
}

}  // namespace

TEST_CASE(
    "straight-line LU: structurally zero pivots - saddle points, cycles, anti-diagonals, arrows upside "
    "down") {
  REQUIRE_CODE(1);
  std::mt19937 random(2026);
  for (bool complex : {false, true})
    for (int round = 0; round < 25; ++round) {
      const int n = 3 + round, m = 1 + round / 3;
      // [M Cᵀ; C 0] with M = diagonal (every second mass is missing where C allows it) and a full C
      Eigen::MatrixXcd kkt = Eigen::MatrixXcd::Zero(n + m, n + m);
      const Eigen::MatrixXcd C = random_matrix(m, n, complex, random);
      for (int i = 0; i < n; ++i) kkt(i, i) = i < m && i % 2 == 1 ? 0.0 : 1.0 + i;
      kkt.topRightCorner(n, m) = C.transpose();
      kkt.bottomLeftCorner(m, n) = C;
      // x₂ … xₙ x₁: no entry on the diagonal, and one coupling more
      Eigen::MatrixXcd cycle = Eigen::MatrixXcd::Zero(n, n);
      for (int i = 0; i < n; ++i) cycle(i, (i + 1) % n) = 1.0 + i, cycle(i, (i + 2) % n) += 0.3;
      Eigen::MatrixXcd anti = Eigen::MatrixXcd::Zero(n, n);
      for (int i = 0; i < n; ++i) anti(i, n - 1 - i) = random_matrix(1, 1, complex, random)(0, 0) + 2.0;
      // first row and column full, diagonal else, but for the first two entries of it
      Eigen::MatrixXcd arrow = Eigen::MatrixXcd::Zero(n, n);
      for (int i = 0; i < n; ++i) {
        arrow(0, i) = 1.0 / (1 + i);
        arrow(i, 0) = 2.0 + i;
        arrow(i, i) = i < 2 ? 0.0 : 3.0;
      }
      for (const Eigen::MatrixXcd& A : {kkt, cycle, anti, arrow}) {
        const int size = static_cast<int>(A.rows());
        const Sample s = pattern_of(A, complex);
        auto lu = StraightLU::plan(size, s.positions, s.values.data(), complex);
        REQUIRE(lu);
        REQUIRE(lu->factorise(s.values.data()));
        CHECK(backward_error(size, s, complex, *lu, random) < 1e-13 * size);
      }
    }
}

TEST_CASE("straight-line LU: a singular matrix is refused or shows a pivot at rounding level") {
  REQUIRE_CODE(1);
  std::mt19937 random(31);
  for (bool complex : {false, true})
    for (int n = 2; n < 30; ++n) {
      CAPTURE(n);
      // Structurally: three rows in two columns, else diagonal.
      Eigen::MatrixXcd hall = Eigen::MatrixXcd::Identity(n + 2, n + 2);
      for (int i = 0; i < 3; ++i) hall.row(i).setZero(), hall(i, 0) = 1.0 + i, hall(i, 1) = 2.0 - i * i;
      const Sample s = pattern_of(hall, complex);
      CHECK(!StraightLU::plan(n + 2, s.positions, s.values.data(), complex));
      // By its values: rank n - 1, or n - 2, in a full pattern.
      const int rank = std::max(1, n - 1 - n % 2);
      const Eigen::MatrixXcd A =
          random_matrix(n, rank, complex, random) * random_matrix(rank, n, complex, random);
      const Sample full = pattern_of(A, complex);
      auto lu = StraightLU::plan(n, full.positions, full.values.data(), complex);
      if (lu && lu->factorise(full.values.data())) CHECK(lu->weakest_pivot() < 1e-13);
    }
}

TEST_CASE("straight-line LU: rows and columns scaled by up to 10^±12, every row is solved in its own units") {
  REQUIRE_CODE(1);
  std::mt19937 random(77);
  std::uniform_int_distribution<> power(-12, 12);
  for (bool complex : {false, true})
    for (int round = 0; round < 40; ++round) {
      const int n = 2 + round;
      Sample s = sample(n, 0.2, complex, random);
      std::vector<double> row(static_cast<std::size_t>(n)), column(row);
      for (double& v : row) v = std::pow(10, power(random));
      for (double& v : column) v = std::pow(10, power(random) / 2);
      const std::size_t width = complex ? 2 : 1;
      for (std::size_t p = 0; p < s.positions.size(); ++p)
        for (std::size_t k = 0; k < width; ++k)
          s.values[width * p + k] *= row[s.positions[p].row] * column[s.positions[p].column];
      auto lu = StraightLU::plan(n, s.positions, s.values.data(), complex);
      if (!lu || !lu->factorise(s.values.data()) || lu->weakest_pivot() < 1e-10) continue;  // a random one
      const Eigen::MatrixXcd A = dense(n, s, complex);
      Eigen::VectorXcd b(n);
      std::vector<double> x;
      for (int i = 0; i < n; ++i) {
        b[i] = row[i] * random_matrix(1, 1, complex, random)(0, 0);
        x.push_back(b[i].real());
        if (complex) x.push_back(b[i].imag());
      }
      lu->solve(x.data());
      Eigen::VectorXcd solution(n);
      for (int i = 0; i < n; ++i) {
        const auto k = static_cast<std::size_t>(i);
        solution[i] = complex ? std::complex<double>(x[2 * k], x[2 * k + 1]) : x[k];
      }
      const Eigen::VectorXd error = (A * solution - b).cwiseAbs(),
                            terms = A.cwiseAbs() * solution.cwiseAbs() + b.cwiseAbs();
      // Multipliers of up to 10 (threshold 0.1) lose a few digits of a row, not all of them.
      for (int i = 0; i < n; ++i) CHECK(error[i] < 1e-10 * terms[i]);
    }
}

TEST_CASE("straight-line LU: other values of the pattern are refused or solved, never silently wrong") {
  REQUIRE_CODE(1);
  std::mt19937 random(123);
  std::uniform_real_distribution<> u(-1, 1);
  int refused = 0, solved = 0;
  for (bool complex : {false, true})
    for (int n : {3, 8, 20, 50})
      for (int round = 0; round < 40; ++round) {
        Sample s = sample(n, 0.15, complex, random);
        auto lu = StraightLU::plan(n, s.positions, s.values.data(), complex);
        if (!lu) continue;
        for (double& v : s.values) v = std::pow(10, 6 * u(random)) * (u(random) < 0 ? -1 : 1);
        const bool fine = lu->factorise(s.values.data());
        ++(fine ? solved : refused);
        // Two multipliers at the limit, 10⁴ each, may follow one another: 10⁸ eps.
        if (fine) CHECK(backward_error(n, s, complex, *lu, random) < 1e-7);
      }
  CHECK(refused > 50);  // the growth check fires
  CHECK(solved > 5);
}

}  // namespace pendula::straight_lu_test
