// A 3-D figure seen from far away (orthographic), turned as gnuplot turns it: first by `turn` about the z
// axis, then by `tilt` about the horizontal of the screen. Also: what a surface hides.
#pragma once

#include <array>
#include <vector>

#include "plot/figure.hpp"

namespace pendula::plot {

using Point3 = std::array<double, 3>;

/// Right and up on the screen, and towards the viewer.
struct Seen {
  double right, up, near;
};

/// Half the size of the box on the screen.
struct Extent {
  double right = 0, up = 0;
};

/// Maps data to the screen. The box of the visible ranges is first scaled to sides `side` (equal units if the
/// figure asks for it, otherwise a pleasant brick) with its centre at the origin.
class View {
 public:
  explicit View(const Figure& figure);
  Seen operator()(const Point3& data) const;
  /// Corner of the box: -1 or +1 per axis, in box coordinates.
  Seen corner(const std::array<int, 3>& sign) const;
  /// Which end of each axis (-1, +1) is towards the viewer.
  std::array<int, 3> near_end() const;
  /// Box ends (-1, +1) of the edge that carries the numbers
  /// of an axis: low and outside. The entry of the axis is 0.
  std::array<int, 3> numbered_edge(int axis) const;
  const Range& range(int axis) const { return ranges_[axis]; }
  double side(int axis) const { return side_[axis]; }
  Extent extent() const;
  Seen rotated(const Point3& box) const;

 private:
  std::array<Range, 3> ranges_;
  Point3 side_;
  double cos_turn_, sin_turn_, cos_tilt_, sin_tilt_;
};

/// Nearness of the front-most surface under each dot of a raster that covers the box.
class DepthMap {
 public:
  DepthMap(const Figure& figure, const View& view);
  /// Is the point behind a surface? Points on the surface itself (within a small tolerance) are not.
  bool hides(const Seen& point) const;

 private:
  static constexpr int cells = 256;  ///< three pixels of a page each, 0.5 MB of depths
  void triangle(const Seen& a, const Seen& b, const Seen& c);
  double reach_;  ///< the raster covers [-reach, reach]²
  std::vector<double> nearest_;
};

}  // namespace pendula::plot
