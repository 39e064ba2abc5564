// Figures: what is refused, in which words; what is noted; which range is shown.
#include "plot/figure.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "base/error.hpp"

namespace pendula::figure_test {

using namespace pendula::plot;

namespace {

const double NaN = std::numeric_limits<double>::quiet_NaN(),
             infinite = std::numeric_limits<double>::infinity();

Vec column(std::initializer_list<double> values) {
  Vec v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}

Figure curve(Vec x, Vec y, std::string label = "") {
  Figure f;
  f.series.push_back({std::move(label), std::move(x), std::move(y), {}, Style::line});
  return f;
}

std::string complaint(const Figure& f) {
  try {
    checked(f);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("figure: what cannot be drawn is refused in the user's words") {
  CHECK(complaint(curve(Vec::Zero(300), Vec::Zero(299))) == "x has 300 values but y has 299");
  CHECK(complaint(curve(column({}), column({}))) == "nothing to draw: the data have no points");
  CHECK(complaint(Figure{}) == "nothing to draw: the figure has no series");
  CHECK(complaint(curve(column({1, 2}), column({NaN, infinite}))) ==
        "nothing to draw: all 2 points are NaN or infinite");
  Figure two = curve(column({1, 2}), column({1, 2}), "a");
  two.series.push_back({"b", column({1, 2}), column({1}), {}, Style::line});
  CHECK(complaint(two) == "x has 2 values but y has 1 ('b')");

  Figure log = curve(column({1, 2}), column({0, -1}));
  log.axes[1].log = true;
  CHECK(complaint(log) ==
        "nothing to draw: the y axis is logarithmic, but none of the 2 points has a positive finite y; use "
        "plot instead");
  Figure limits = curve(column({1, 2}), column({0, 1}));
  limits.axes[0].limits = Range{3, 1};
  CHECK(complaint(limits) == "xlim = {3, 1}: the first limit must be below the second");
  limits.axes[0].limits = Range{0, NaN};
  CHECK(complaint(limits) == "xlim = {0, nan}: both limits must be finite numbers");
  limits.axes[0].limits = Range{0, 1};
  limits.axes[0].log = true;
  CHECK(complaint(limits) == "xlim = {0, 1}: limits of a logarithmic axis must be positive");
  CHECK(complaint(curve(column({0, 1}), column({-1e308, 1e308}))).find("too far for a linear axis") !=
        std::string::npos);
}

TEST_CASE("figure: 3-D figures are checked too") {
  Figure f = curve(column({1, 2}), column({1, 2}));
  f.three_d = true;
  CHECK(complaint(f) == "x has 2 values but z has 0");
  f.series[0].z = column({1, 2});
  CHECK(complaint(f).empty());
  f.surfaces.push_back({Mat::Zero(3, 3), Mat::Zero(3, 3), Mat::Zero(3, 2)});
  CHECK(complaint(f) ==
        "surface 1: x, y and z must be grids of the same size, but they are 3×3, 3×3 and 3×2");
  f.surfaces[0] = {Mat::Zero(1, 3), Mat::Zero(1, 3), Mat::Zero(1, 3)};
  CHECK(complaint(f) == "surface 1: a grid needs at least 2×2 nodes, this one has 1×3");
  f.surfaces.clear();
  f.tilt = 120;
  CHECK(complaint(f).find("the tilt must lie between 0") != std::string::npos);
  CHECK_THROWS_WITH(sphere(-1, {0, 0, 0}), "the radius must be a positive number, got -1");
}

TEST_CASE("figure: gaps are counted in notes") {
  const Figure f = checked(curve(column({1, 2, 3, 4}), column({1, NaN, 3, infinite}), "x"));
  REQUIRE(f.notes.size() == 1);
  CHECK(f.notes[0] == "2 of 4 points of 'x' are not finite (drawn as gaps)");
  Figure log = curve(column({1, 2, 3}), column({1, 0.1, 0}));
  log.axes[1].log = true;
  const Figure g = checked(log);
  REQUIRE(g.notes.size() == 1);
  CHECK(g.notes[0] == "1 of 3 points of the data is not positive: no place on the logarithmic y axis");
}

TEST_CASE("figure: the visible range is never empty and has a margin across the curve only") {
  const Range x = visible(curve(column({0, 10}), column({0, 1})), 0);
  CHECK(x.low == 0);
  CHECK(x.high == 10);
  const Range y = visible(curve(column({0, 10}), column({0, 1})), 1);
  CHECK(y.low == doctest::Approx(-0.04));
  const Range flat = visible(curve(column({0, 1}), column({5, 5})), 1);
  CHECK(flat.low == doctest::Approx(4.75));
  CHECK(flat.high == doctest::Approx(5.25));
  // Rounding noise around 1 is drawn as the constant that it is.
  CHECK(visible(curve(column({0, 1}), column({1, 1 + 2e-16})), 1).span() > 0.01);
  CHECK(visible(curve(column({0, 1}), column({0, 0})), 1).span() == 2);
  // A limited x axis: y shows what is left.
  Figure part = curve(column({0, 1, 2, 3}), column({0, 1, 2, 1000}));
  part.axes[0].limits = Range{0, 2};
  CHECK(visible(part, 1).high < 3);
}

TEST_CASE("figure: labels and descriptions") {
  CHECK(axis_label(curve(column({0}), column({0}), "x [m]"), 1) == "x [m]");
  CHECK(!has_legend(curve(column({0}), column({0}), "x [m]")));
  Figure f = curve(column({0, 1}), column({0, 1}), "a");
  f.title = "Drift";
  CHECK(describe(f) == "figure 'Drift': 1 series, 2 points");
  CHECK(style_named("line+points") == Style::line_points);
  CHECK_THROWS_WITH(
      style_named("lines"),
      "unknown style 'lines'. Did you mean 'line'? Styles: line, points, line+points, dots, impulses, "
      "steps, cells, fill");
}

TEST_CASE("figure: every node of a sphere lies on it") {
  const Surface s = sphere(2, {1, 0, -1});
  for (Eigen::Index i = 0; i < s.x.size(); ++i)
    CHECK(std::hypot(s.x.data()[i] - 1, s.y.data()[i], s.z.data()[i] + 1) ==
          doctest::Approx(2).epsilon(1e-14));
}

}  // namespace pendula::figure_test
