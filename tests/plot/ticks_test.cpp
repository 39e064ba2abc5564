// Numbers on axes: steps, decades, common factors and offsets.
#include "plot/ticks.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "base/text.hpp"

namespace pendula::ticks_test {

using namespace pendula::plot;

namespace {

std::string words(const Ticks& t) { return join(t.text, " ") + (t.suffix.empty() ? "" : " | " + t.suffix); }

}  // namespace

TEST_CASE("ticks: steps of 1, 2 and 5") {
  CHECK(words(linear_ticks({0, 10}, 5)) == "0 2 4 6 8 10");
  CHECK(words(linear_ticks({0, 1}, 5)) == "0.0 0.2 0.4 0.6 0.8 1.0");
  CHECK(words(linear_ticks({-1.04, 1.04}, 5)) == "-1.0 -0.5 0.0 0.5 1.0");
  CHECK(linear_ticks({0.03, 0.97}, 2).at.size() >= 2);  // one number alone is no scale
}

TEST_CASE("ticks: small, large and nearly constant numbers share a factor or an offset") {
  CHECK(words(linear_ticks({0, 3e-8}, 4)) == "0 1 2 3 | ×10⁻⁸");
  CHECK(words(linear_ticks({0, 4e6}, 4)) == "0 1 2 3 4 | ×10⁶");
  CHECK(words(linear_ticks({0.001, 0.005}, 4)) == "0.001 0.002 0.003 0.004 0.005");
  const Ticks t = linear_ticks({9.81, 9.81 + 4e-9}, 4);
  CHECK(t.suffix.find("+ 9.81") != std::string::npos);
  for (size_t k = 1; k < t.text.size(); ++k) CHECK(t.text[k] != t.text[k - 1]);
}

TEST_CASE("ticks: whole numbers only where fractions mean nothing") {
  CHECK(words(linear_ticks({0.5, 3.5}, 9, 1)) == "1 2 3");
  CHECK(words(linear_ticks({0, 1}, 9, 1)) == "0 1");
}

TEST_CASE("ticks: decades") {
  CHECK(words(log_ticks({1e-3, 1e3}, 7)) == "0.001 0.01 0.1 1 10 100 1000");
  CHECK(words(log_ticks({1e-16, 1}, 6)) == "10⁻¹⁵ 10⁻¹² 10⁻⁹ 10⁻⁶ 10⁻³ 10⁰");
  CHECK(words(log_ticks({0.9, 11}, 8)) == "1 2 5 10");
  CHECK(words(log_ticks({1.8e-8, 6e-8}, 8)) == "2·10⁻⁸ 5·10⁻⁸");
  CHECK(log_ticks({1, 10}, 8).minor.size() == 8);  // 2, …, 9
  CHECK(log_ticks({3.1, 3.3}, 5).at.size() >= 2);  // within a decade: as on a linear axis
}

TEST_CASE("ticks: all lie inside the range, increase, and are never many") {
  // Ranges of all sizes and places: every combination of centre and width.
  for (double centre : {0.0, 1.0, -9.81, 1e6, -1e-7, 1e300, 3e-300})
    for (double width : {1e-12, 1e-3, 0.7, 1.0, 4.4, 100.0, 1e9}) {
      const double size = std::max(std::abs(centre), 1e-299);
      const Range r{centre - width * size, centre + width * size};
      if (!std::isfinite(r.span()) || r.high > 1e305) continue;
      for (int count : {1, 2, 5, 9}) {
        CAPTURE(centre);
        CAPTURE(width);
        CAPTURE(count);
        const Ticks t = linear_ticks(r, count);
        CHECK(t.at.size() == t.text.size());
        CHECK(!t.at.empty());
        CHECK(t.at.size() <= static_cast<size_t>(std::max(count + 1, 5)));
        for (size_t k = 0; k < t.at.size(); ++k) {
          CHECK(t.at[k] >= r.low - 1e-8 * r.span());
          CHECK(t.at[k] <= r.high + 1e-8 * r.span());
          if (k) CHECK(t.at[k] > t.at[k - 1]);
        }
      }
    }
}

TEST_CASE("ticks: fraction of an axis") {
  Axis axis;
  CHECK(fraction(axis, {2, 6}, 3) == 0.25);
  axis.reversed = true;
  CHECK(fraction(axis, {2, 6}, 3) == 0.75);
  axis.reversed = false;
  axis.log = true;
  CHECK(fraction(axis, {1e-4, 1}, 1e-3) == doctest::Approx(0.25));
}

}  // namespace pendula::ticks_test
