// Golden section search against minima that are known.
#include "base/search/golden_section.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <utility>

#include "base/epsilon.hpp"

namespace pendula::golden_section_test {

TEST_CASE("golden section: a kink is found to rounding, a smooth minimum to its square root") {
  for (double c : {0.1, 0.5, 1 / 3.0, 0.987}) {
    CAPTURE(c);
    const auto kink = [&](double x) { return x < c ? 3 * (c - x) : x - c; };
    CHECK(std::fabs(golden_section(kink, 0, 1, 90).middle() - c) <= 4 * eps);
  }
  // x - ln x = 1 + (x - 1)²/2 - …: constant to ε within √(2ε) of 1
  const auto smooth = [](double x) { return x - std::log(x); };
  const GoldenSection s = golden_section(smooth, 0.2, 5, 90);
  CHECK(std::fabs(s.best() - 1) <= 4 * std::sqrt(2 * eps));
  CHECK(s.least() == 1);
}

TEST_CASE("golden section: every section leaves 0.618 of the interval and costs one evaluation") {
  int evaluations = 0;
  const auto square = [&](double x) {
    ++evaluations;
    return (x - 2) * (x - 2);
  };
  const double ratio = (std::sqrt(5.0) - 1) / 2;
  for (int sections : {0, 1, 2, 10}) {
    evaluations = 0;
    const GoldenSection s = golden_section(square, 0, 5, sections);
    CHECK(evaluations == 4 + sections);
    CHECK(s.high - s.low == doctest::Approx(5 * std::pow(ratio, sections)).epsilon(1e-13));
    CHECK((s.left - s.low) / (s.high - s.low) == doctest::Approx(1 - ratio).epsilon(1e-12));
    CHECK((s.high - s.right) / (s.high - s.low) == doctest::Approx(1 - ratio).epsilon(1e-12));
    CHECK(s.low <= 2);
    CHECK(s.high >= 2);
    for (const auto& [x, value] : {std::pair{s.low, s.at_low}, std::pair{s.left, s.at_left},
                                   std::pair{s.right, s.at_right}, std::pair{s.high, s.at_high}})
      CHECK(value == (x - 2) * (x - 2));
  }
}

TEST_CASE("golden section: a monotone function leads to the end, and a condition ends the search") {
  const auto rising = [](double x) { return x; };
  CHECK(golden_section(rising, 1, 2, 90).low <= 1 + 4 * eps);  // points that coincide are equally good
  CHECK(golden_section(rising, 1, 2, 90).high <= 1 + 4 * eps);
  int asked = 0;
  const GoldenSection s = golden_section(rising, 0, 1, 90, [&](const GoldenSection& at, int k) {
    CHECK(k == asked++);
    return at.least() < 0.1;
  });
  CHECK(s.least() < 0.1);
  CHECK(s.at_high >= 0.1);
  CHECK(asked < 10);
}

}  // namespace pendula::golden_section_test
