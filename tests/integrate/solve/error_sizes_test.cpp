// Norms four numbers at a time against the plain loops.
#include "integrate/solve/error_sizes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <doctest/doctest.h>

namespace pendula::error_sizes_test {

using namespace pendula::integrate;

TEST_CASE("error sizes: sums and largest of every length, to rounding") {
  std::mt19937 random(3);
  const auto draw = [&](int n, double from, double to) {
    std::vector<double> v(static_cast<std::size_t>(n));
    for (double& x : v) x = std::uniform_real_distribution(from, to)(random);
    return v;
  };
  for (int n = 0; n < 40; ++n) {
    CAPTURE(n);
    const auto before = draw(n, -3, 3), after = draw(n, -3, 3), e = draw(n, -1, 1), other = draw(n, -1, 1);
    const auto atol = draw(n, 0.1, 1), rtol = draw(n, 0.1, 1);
    std::vector<double> inverse(before.size()), scaled(before.size());
    const ErrorSizes sizes = error_sizes(n, before.data(), after.data(), atol.data(), rtol.data(), e.data(),
                                         other.data(), inverse.data(), scaled.data());
    const ChangeSizes changes =
        change_sizes(n, before.data(), after.data(), after.data(), atol.data(), rtol.data());
    Squares first, second;
    double change = 0, size = 0, share = 0;
    for (std::size_t k = 0; k < before.size(); ++k) {
      const double w = 1 / (atol[k] + rtol[k] * std::max(std::fabs(before[k]), std::fabs(after[k])));
      CHECK(inverse[k] == w);
      CHECK(scaled[k] == e[k] * w);
      first.sum += e[k] * w * (e[k] * w);
      first.largest = std::max(first.largest, scaled[k] * scaled[k]);
      second.sum += other[k] * w * (other[k] * w);
      const double v = 1 / (atol[k] + rtol[k] * std::fabs(after[k]));
      change += std::pow((before[k] - after[k]) * v, 2);
      size += std::pow(before[k] * v, 2);
      share = std::max(share, std::fabs(before[k]) / (atol[k] + rtol[k] * std::fabs(after[k])));
    }
    CHECK(sizes.first.sum == doctest::Approx(first.sum).epsilon(1e-14));
    CHECK(sizes.second.sum == doctest::Approx(second.sum).epsilon(1e-14));
    CHECK(sizes.first.largest == first.largest);
    CHECK(changes.change == doctest::Approx(change).epsilon(1e-14));
    CHECK(changes.size == doctest::Approx(size).epsilon(1e-14));
    CHECK(largest_share(n, before.data(), after.data(), atol.data(), rtol.data()) == share);
  }
}

TEST_CASE("error sizes: a number that is not finite is seen at every place") {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (std::size_t n : {1U, 5U, 16U, 37U})
      for (std::size_t place = 0; place < n; ++place) {
        std::vector<double> x(n, 1e300);
        CHECK(all_finite(static_cast<int>(n), x.data()));
        x[place] = bad;
        CHECK_FALSE(all_finite(static_cast<int>(n), x.data()));
      }
}

}  // namespace pendula::error_sizes_test
