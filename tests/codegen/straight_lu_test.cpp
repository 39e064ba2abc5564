// Straight-line LU against Eigen's dense LU, on random patterns, bad scales, and matrices it must refuse.
#include <doctest/doctest.h>

#include <complex>
#include <random>

#include "base/decompositions.hpp"
#include "base/math.hpp"
#include "codegen/straight_lu.hpp"

using namespace pendula;
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
  for (int i = 0; i < n; ++i) permutation[static_cast<std::size_t>(i)] = i;
  std::shuffle(permutation.begin(), permutation.end(), random);
  Sample s;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const bool must = permutation[static_cast<std::size_t>(i)] == j;
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
  if (!codegen::Machine::available()) return;
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
  if (!codegen::Machine::available()) return;
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
  for (int i = 0; i < 12; ++i) b[static_cast<std::size_t>(i)] = std::pow(10.0, (i * 7 % 25) - 12) * (1 + i);
  lu->solve(b.data());
  Eigen::VectorXd plain_right(12);
  for (int i = 0; i < 12; ++i) plain_right[i] = 1 + i;
  const Eigen::VectorXd x = plain.partialPivLu().solve(plain_right);
  for (int j = 0; j < 12; ++j)
    CHECK(b[static_cast<std::size_t>(j)] * std::pow(10.0, (j * 5 % 17) - 8) ==
          doctest::Approx(x[j]).epsilon(1e-9));
}

TEST_CASE("straight-line LU: refuses what its pivots do not suit, and singular or undefined matrices") {
  if (!codegen::Machine::available()) return;
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
