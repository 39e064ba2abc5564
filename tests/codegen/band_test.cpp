#include "codegen/routines/band.hpp"

#include <doctest/doctest.h>

#include <Eigen/Dense>

#include <cmath>
#include <random>
#include <vector>

namespace pendula::band_test {

TEST_CASE("band: definite matrices of all small sizes agree with dense elimination") {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int band = 1; band <= 5; ++band)
    for (int n = 1; n <= 23; ++n) {
      CAPTURE(band);
      CAPTURE(n);
      const auto size = static_cast<std::size_t>(n);
      std::vector<double> a(size * static_cast<std::size_t>(band + 1),
                            1e9);  // what lies before row 0 is not read
      Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
      Eigen::VectorXd b(n);
      for (int i = 0; i < n; ++i) {
        b[i] = uniform(random);
        for (int k = 0; k <= std::min(i, band); ++k) {
          const double value = k == 0 ? 2 * band + 1 + uniform(random) : uniform(random);
          A(i, i - k) = A(i - k, i) = a[static_cast<std::size_t>(k) * size + static_cast<std::size_t>(i)] =
              value;
        }
      }
      std::vector<double> x(b.begin(), b.end());
      codegen::band_factor(a.data(), n, band);
      codegen::band_solve(x.data(), n, a.data(), band);
      // Diagonally dominant: condition below 4, a handful of roundings per row.
      const Eigen::VectorXd exact = A.ldlt().solve(b);
      for (int i = 0; i < n; ++i) CHECK(std::fabs(x[i] - exact[i]) < 1e-14);
    }
}

TEST_CASE("band: a matrix known by heart") {
  // -u'' = 1 with n = 99 interior points of (0, 1), h = 1/100: the three-point
  // formula is exact for a parabola.
  constexpr int n = 99;
  constexpr double h = 0.01;
  std::vector<double> a(2 * n, -1), x(n, h * h);
  std::fill_n(a.begin(), n, 2.0);
  codegen::band_factor(a.data(), n, 1);
  codegen::band_solve(x.data(), n, a.data(), 1);
  for (int i = 0; i < n; ++i) {
    const double at = (i + 1) * h;
    CHECK(x[i] == doctest::Approx(at * (1 - at) / 2).epsilon(1e-12));  // condition 4·10³
  }
}

}  // namespace pendula::band_test
