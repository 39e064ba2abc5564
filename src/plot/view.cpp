#include "plot/view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace pendula::plot {

View::View(const Figure& figure) {
  double longest = 0;
  for (int a = 0; a < 3; ++a) {
    ranges_[a] = visible(figure, a);
    longest = std::max(longest, range(a).span());
  }
  // sides of the box; with equal axes a flat one keeps 2 % of the longest
  const Point3 brick{1.0, 1.0, 0.75};
  for (size_t a = 0; a < 3; ++a)
    side_[a] = figure.equal ? std::max(ranges_[a].span() / longest, 0.02) : brick[a];
  const double degree = std::numbers::pi / 180;
  cos_turn_ = std::cos(figure.turn * degree);
  sin_turn_ = std::sin(figure.turn * degree);
  cos_tilt_ = std::cos(figure.tilt * degree);
  sin_tilt_ = std::sin(figure.tilt * degree);
}

Seen View::rotated(const Point3& p) const {
  const double right = p[0] * cos_turn_ + p[1] * sin_turn_;
  const double back = p[1] * cos_turn_ - p[0] * sin_turn_;
  return {right, back * cos_tilt_ + p[2] * sin_tilt_, p[2] * cos_tilt_ - back * sin_tilt_};
}

Seen View::operator()(const Point3& data) const {
  Point3 box;
  for (size_t a = 0; a < 3; ++a) box[a] = side_[a] * ((data[a] - ranges_[a].low) / ranges_[a].span() - 0.5);
  return rotated(box);
}

Seen View::corner(const std::array<int, 3>& sign) const {
  return rotated({0.5 * sign[0] * side_[0], 0.5 * sign[1] * side_[1], 0.5 * sign[2] * side_[2]});
}

std::array<int, 3> View::near_end() const {
  std::array<int, 3> end;
  for (size_t a = 0; a < 3; ++a) {
    Point3 unit{0, 0, 0};
    unit[a] = 1;
    constexpr double rounding = 1e-12;  // of a rotation: seen along an axis, its far end is the near one
    end[a] = rotated(unit).near >= -rounding ? 1 : -1;
  }
  return end;
}

std::array<int, 3> View::numbered_edge(int axis) const {
  const auto near = near_end();
  if (axis == 0) return {0, near[1], -near[2]};
  if (axis == 1) return {near[0], 0, -near[2]};
  constexpr double same_place = 1e-9;  // of the box: of edges above each other the first one
  std::array<int, 3> leftmost{-1, -1, 0};
  for (int x : {-1, 1})
    for (int y : {-1, 1})
      if (corner({x, y, 0}).right < corner(leftmost).right - same_place) leftmost = {x, y, 0};
  return leftmost;
}

Extent View::extent() const {
  Extent e;
  for (int x : {-1, 1})
    for (int y : {-1, 1})
      for (int z : {-1, 1}) {
        const Seen c = corner({x, y, z});
        e.right = std::max(e.right, std::abs(c.right));
        e.up = std::max(e.up, std::abs(c.up));
      }
  return e;
}

DepthMap::DepthMap(const Figure& figure, const View& view)
    : nearest_(static_cast<size_t>(cells) * cells, -std::numeric_limits<double>::infinity()) {
  reach_ = 0.5 * std::hypot(view.side(0), view.side(1), view.side(2));
  for (const Surface& s : figure.surfaces)
    for (Eigen::Index i = 0; i + 1 < s.x.rows(); ++i)
      for (Eigen::Index j = 0; j + 1 < s.x.cols(); ++j) {
        const auto node = [&](Eigen::Index r, Eigen::Index c) {
          return view({s.x(r, c), s.y(r, c), s.z(r, c)});
        };
        const Seen a = node(i, j), b = node(i, j + 1), c = node(i + 1, j + 1), d = node(i + 1, j);
        triangle(a, b, c);
        triangle(a, c, d);
      }
}

void DepthMap::triangle(const Seen& a, const Seen& b, const Seen& c) {
  const auto to_cell = [&](double v) { return (v / reach_ + 1) * 0.5 * cells - 0.5; };
  const double ax = to_cell(a.right), ay = to_cell(a.up), bx = to_cell(b.right), by = to_cell(b.up);
  const double cx = to_cell(c.right), cy = to_cell(c.up);
  const double area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
  constexpr double none = 1e-9;          // of a cell
  constexpr double on_edge = 1e-9;       // of a side: neighbouring triangles leave no gap
  if (!(std::abs(area) > none)) return;  // seen edge-on, or NaN
  const auto bound = [](double v) { return static_cast<int>(std::clamp(v, 0.0, cells - 1.0)); };
  const int x0 = bound(std::floor(std::min({ax, bx, cx}))), x1 = bound(std::ceil(std::max({ax, bx, cx})));
  const int y0 = bound(std::floor(std::min({ay, by, cy}))), y1 = bound(std::ceil(std::max({ay, by, cy})));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {  // barycentric coordinates of the raster point
      const double v = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area;
      const double w = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area;
      if (v < -on_edge || w < -on_edge || v + w > 1 + on_edge) continue;
      double& depth = nearest_[static_cast<size_t>(y) * cells + static_cast<size_t>(x)];
      depth = std::max(depth, a.near + v * (b.near - a.near) + w * (c.near - a.near));
    }
}

bool DepthMap::hides(const Seen& p) const {
  const auto to_cell = [&](double v) { return std::lround((v / reach_ + 1) * 0.5 * cells - 0.5); };
  const long x = to_cell(p.right), y = to_cell(p.up);
  if (x < 0 || x >= cells || y < 0 || y >= cells) return false;
  // The facets of the grid cut off up to 2 % of a sphere: the tolerance keeps a curve on the surface from
  // being hidden by them in places.
  return nearest_[static_cast<size_t>(y) * cells + static_cast<size_t>(x)] > p.near + 0.04 * reach_;
}

}  // namespace pendula::plot
