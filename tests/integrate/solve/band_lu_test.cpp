// Elimination in a band: orders found for shuffled systems, pivots, determinants, refusals.
#include "integrate/solve/band_lu.hpp"

#include <cmath>
#include <numeric>
#include <random>

#include <doctest/doctest.h>

#include "base/decompositions.hpp"
#include "base/math.hpp"
#include "tests/integrate/solve/scalars.hpp"

namespace pendula::band_lu_test {

using namespace pendula::integrate;
using pendula::test::number;

namespace {

template <class Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

/// A band with random entries, some missing, small diagonals, then rows and columns shuffled.
template <class Scalar>
Matrix<Scalar> shuffled_band(int n, int below, int above, std::mt19937& random,
                             std::vector<Position>& positions, std::vector<Scalar>& values) {
  std::uniform_real_distribution<> u(-1, 1);
  std::vector<int> rows(static_cast<std::size_t>(n)), columns(rows.size());
  std::iota(rows.begin(), rows.end(), 0), std::iota(columns.begin(), columns.end(), 0);
  std::shuffle(rows.begin(), rows.end(), random), std::shuffle(columns.begin(), columns.end(), random);
  Matrix<Scalar> A = Matrix<Scalar>::Zero(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = std::max(0, i - below); j <= std::min(n - 1, i + above); ++j) {
      if (i != j && random() % 4 == 0) continue;
      const int parts = random() % 10 == 0 ? 2 : 1;  // an entry may be given in parts
      for (int part = 0; part < parts; ++part) {
        positions.push_back({rows[i], columns[j]});
        values.push_back(number<Scalar>(i == j ? 0.01 * u(random) : u(random), u(random)));
        A(positions.back().row, positions.back().column) += values.back();
      }
    }
  return A;
}

template <class Scalar>
void check_bands() {
  std::mt19937 random(7);
  int narrow = 0;
  for (int n : {1, 2, 5, 40, 163})
    for (const auto& [below, above] :
         {std::pair(0, 0), std::pair(1, 1), std::pair(0, 2), std::pair(3, 1), std::pair(4, 5)}) {
      std::vector<Position> positions;
      std::vector<Scalar> values;
      const auto A = shuffled_band<Scalar>(n, below, above, random, positions, values);
      const auto order = BandOrder::find(n, positions);
      if (!order) continue;
      ++narrow;
      BandLU<Scalar> lu(positions, order);
      const Eigen::PartialPivLU<Matrix<Scalar>> full(A);
      const auto pivots = full.matrixLU().diagonal().cwiseAbs().eval();
      if (!(pivots.minCoeff() > 0) || full.rcond() < 1e-10) continue;
      for (int twice = 0; twice < 2; ++twice) {
        CAPTURE(n);
        CAPTURE(order->below);
        CAPTURE(order->above);
        REQUIRE(lu.factorise(values.data()));
        Eigen::Matrix<Scalar, Eigen::Dynamic, 1> b(n), x;
        for (int i = 0; i < n; ++i) b[i] = number<Scalar>(std::cos(i), std::sin(3.0 * i));
        x = b;
        lu.solve(x.data());
        const double size = A.cwiseAbs().rowwise().sum().maxCoeff() * x.cwiseAbs().maxCoeff();
        CHECK((A * x - b).cwiseAbs().maxCoeff() < 1e-13 * size);  // growth of threshold pivoting included
      }
      CHECK(lu.weakest_pivot() > 0);
      double log = 0;
      const int sign = lu.determinant(log);
      if constexpr (std::is_same_v<Scalar, double>) {
        CHECK(sign == (full.determinant() > 0 ? 1 : -1));
        CHECK(log == doctest::Approx(pivots.array().log().sum()).epsilon(1e-9));
      } else {
        CHECK(sign == 0);
      }
    }
  CHECK(narrow >= 20);
}

}  // namespace

TEST_CASE("band: shuffled systems with small pivots are solved, real and complex") {
  check_bands<double>();
  check_bands<std::complex<double>>();
}

TEST_CASE("band: a line in any numbering has as many diagonals as it needs") {
  std::mt19937 random(2);
  const int n = 300;
  std::vector<int> place(n);
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), random);
  std::vector<Position> line, ring, wide;
  for (int i = 0; i < n; ++i)
    for (int d = -1; d <= 1; ++d) {
      const auto at = [&](int k) { return place[(k + n) % n]; };
      if (i + d >= 0 && i + d < n) line.push_back({at(i), at(i + d)});
      ring.push_back({at(i), at(i + d)});
      for (int j = 0; j < n; j += 40) wide.push_back({at(i), at(j)});
    }
  const auto tridiagonal = BandOrder::find(n, line), two = BandOrder::find(n, ring);
  REQUIRE(tridiagonal);
  CHECK(tridiagonal->below == 1);
  CHECK(tridiagonal->above == 1);
  REQUIRE(two);  // from one end of a ring both ways: every second unknown is a neighbour
  CHECK(two->below == 2);
  CHECK(two->above == 2);
  CHECK_FALSE(BandOrder::find(n, wide));
}

TEST_CASE(
    "band: rows and columns that do not belong together are matched; without a matching there is no band") {
  std::vector<Position> shifted;  // row i holds the unknowns i + 1 and i + 2 (mod n)
  const int n = 60;
  for (int i = 0; i < n; ++i) shifted.push_back({i, (i + 1) % n}), shifted.push_back({i, (i + 2) % n});
  const auto order = BandOrder::find(n, shifted);
  REQUIRE(order);
  CHECK(order->below + order->above <= 4);
  CHECK_FALSE(BandOrder::find(3, {{0, 0}, {1, 0}, {2, 1}, {2, 2}}));  // two rows for one unknown
}

TEST_CASE("band: singular matrices and numbers that are not finite are refused, and leave nothing behind") {
  std::vector<Position> positions;
  std::vector<double> values;
  for (int i = 0; i < 50; ++i)
    for (int j = std::max(0, i - 1); j <= std::min(49, i + 1); ++j)
      positions.push_back({i, j}), values.push_back(i == j ? 2 : -1);
  const auto order = BandOrder::find(50, positions);
  REQUIRE(order);
  BandLU<double> lu(positions, order);
  CHECK(lu.factorise(values.data()));
  auto wrong = values;
  wrong[20] = NAN;
  CHECK_FALSE(lu.factorise(wrong.data()));
  wrong[20] = INFINITY;
  CHECK_FALSE(lu.factorise(wrong.data()));
  wrong = values;
  wrong.front() = wrong.back() = 1;  // every row adds up to 0
  CHECK_FALSE(lu.factorise(wrong.data()));
  std::fill(wrong.begin(), wrong.begin() + 2, 0.0);  // a row of zeros
  CHECK_FALSE(lu.factorise(wrong.data()));
  REQUIRE(lu.factorise(values.data()));
  std::vector<double> b(50, NAN);
  lu.solve(b.data());
  std::fill(b.begin(), b.end(), 1.0);
  lu.solve(b.data());
  CHECK(b[24] == doctest::Approx(325));  // (i + 1)(n - i)/2 at i = 24: 25·26/2
}

}  // namespace pendula::band_lu_test
