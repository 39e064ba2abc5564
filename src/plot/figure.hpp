// A figure is plain data: what is to be seen, and nothing about how. Two back ends read it: terminal.hpp
// (Unicode braille) and gnuplot.hpp (SVG, PNG, PDF). `checked` is the only door: a figure that passed it can
// be drawn.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/math.hpp"

namespace pendula::plot {

enum class Style {
  line,
  points,
  line_points,
  dots,      ///< the smallest mark the back end has
  impulses,  ///< a stroke from zero to each point
  steps,     ///< held until the next point, as a sampled input is
  cells      ///< unit squares around the points: the pattern of a matrix
};

/// "line", "points", "line+points", …; throws Error with the list and "did you mean" otherwise.
Style style_named(const std::string& name);
const std::vector<std::string>& style_names();

struct Range {
  double low = 0, high = 1;
  double span() const { return high - low; }
};

struct Axis {
  std::string label;
  bool log = false;
  bool reversed = false;        ///< low values on top: rows of a matrix
  bool whole = false;           ///< ticks at whole numbers only: a count or an index
  std::optional<Range> limits;  ///< chosen by the user; otherwise from the data
};

/// One curve or point set. In 2-D `z` is empty. A value that is NaN or infinite is a gap in the line.
struct Series {
  std::string label;
  Vec x, y, z;
  Style style = Style::line;
  std::array<double, 2> cell{0.9, 0.9};  ///< width and height of Style::cells
};

/// A surface on a parametric grid: node (i, j) is (x(i,j), y(i,j), z(i,j)); drawn as a mesh one can see
/// through.
struct Surface {
  Mat x, y, z;
};

struct Figure {
  std::string title;
  std::array<Axis, 3> axes;  ///< x, y, z
  std::vector<Series> series;
  std::vector<Surface> surfaces;  ///< 3-D only
  bool three_d = false;
  bool equal = false;           ///< one unit is equally long on all axes
  bool legend = true;           ///< shown when at least two series have labels
  double tilt = 60, turn = 30;  ///< 3-D view in degrees: 0 ≤ tilt ≤ 90 (0: from above), turn about the z axis
  std::array<int, 2> size{0, 0};  ///< of a saved file in pixels (points for PDF: 3/4 of that); 0: the default
  std::vector<std::string> notes;  ///< small text under the figure; `checked` adds what could not be drawn
  std::vector<Figure>
      below;  ///< 2-D: further checked figures drawn under this one, as the phase under the gain
};

/// Validates and completes: lengths agree, limits are in order, something finite is left to draw. Counts the
/// points that cannot be drawn (not finite; not positive on a log axis) and says so in `notes`. throws  Error
/// that names the argument in the user's words ("x has 300 values but y has 299").
Figure checked(Figure figure);

/// May this point be drawn? All coordinates finite, and positive on log axes.
bool drawable(const Figure& figure, const Series& series, Eigen::Index i);

/// The range to show on axis 0, 1, 2: the user's, or that of the drawable data with a margin. Never empty,
/// always finite.
Range visible(const Figure& figure, int axis);

/// Series with labels worth a legend: at least two, and the user did not switch it off.
bool has_legend(const Figure& figure);

/// Label of an axis; the y axis of a single labelled series takes that label when it has none.
std::string axis_label(const Figure& figure, int axis);

/// "figure 'Drift': 2 curves, 602 points" — what print() shows.
std::string describe(const Figure& figure);

/// The sphere with this radius and centre as a grid of latitudes × longitudes. Requires radius > 0 and
/// finite.
Surface sphere(double radius, const std::array<double, 3>& center, int latitudes = 24, int longitudes = 48);

}  // namespace pendula::plot
