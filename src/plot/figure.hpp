// A figure is plain data: what is to be seen, and nothing about how. Two back ends read it: braille.hpp (the
// terminal) and gnuplot.hpp (SVG, PNG, PDF). `checked` is the only door: a figure
// that passed it can be drawn.
//
// ticks.hpp, view.hpp: numbers on axes, and the projection of three dimensions, for both. canvas.hpp,
// sheet.hpp: cells of a terminal, pens and legends. script.hpp: pieces of gnuplot's language; process.cpp
// runs it. film.hpp: figures in time.
#pragma once

#include <algorithm>
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
  cells,     ///< unit squares around the points: the pattern of a matrix
  fill       ///< the area between `lower` (or zero) and y
};

enum class Dash { automatic, solid, dashed, dotted, dashdot };
enum class Mark { automatic, circle, ring, square, box, triangle, diamond, plus, cross };

/// "line", "points", "line+points", …; throws Error with the list and "did you mean" otherwise.
Style style_named(const std::string& name);
const std::vector<std::string>& style_names();  ///< in the order of Style
/// "solid", "dashed", … and "circle", "ring", …; throw Error as style_named does.
Dash dash_named(const std::string& name);
Mark mark_named(const std::string& name);
/// In the order of Dash and of Mark.
const std::vector<std::string>& dash_names();
const std::vector<std::string>& mark_names();
/// "#rrggbb" of a colour's name or of itself; throws Error with the list of names.
std::string colour_named(const std::string& name);

struct Range {
  double low = 0, high = 1;
  double span() const { return high - low; }
};

struct Axis {
  std::string label;
  bool log = false;
  bool reversed = false;        ///< low values on top: rows of a matrix
  bool whole = false;           ///< ticks at whole numbers only: a count or an index
  double step = 0;              ///< distance of the ticks of a linear axis; 0: chosen
  std::optional<Range> limits;  ///< chosen by the user; otherwise from the data
};

/// One curve or point set. In 2-D `z` is empty. A value that is NaN or infinite is a gap in the line.
struct Series {
  std::string label;
  Vec x, y, z;
  Style style = Style::line;
  std::array<double, 2> cell{0.9, 0.9};  ///< width and height of Style::cells
  std::string colour{};                  ///< "#rrggbb"; empty: the next of the palette
  double width = 0;                      ///< of the line in pixels; 0: the usual one
  Dash dash = Dash::automatic;
  Mark mark = Mark::automatic;
  Vec value{};                         ///< of Style::cells: a number per cell that becomes its colour
  Vec lower{};                         ///< of Style::fill, as long as y; empty: zero
  std::vector<Eigen::Index> breaks{};  ///< points before which the line is interrupted, ascending
  std::vector<Eigen::Index> marked{};  ///< points that get marks; empty: all of them

  bool starts_at(Eigen::Index i) const { return std::binary_search(breaks.begin(), breaks.end(), i); }
};

/// A straight line across the frame at a value of axis 0 (vertical) or 1 (horizontal).
struct Rule {
  int axis = 1;
  double at = 0;
  std::string label;
};

/// A text whose left end stands at a point.
struct Words {
  double x = 0, y = 0;
  std::string text;
};

enum class LegendPlace {
  automatic,
  none,
  top_left,
  top_right,
  bottom_left,
  bottom_right,
  above,
  right,
  below
};
LegendPlace legend_place_named(const std::string& name);
const std::vector<std::string>& legend_places();  ///< in the order of LegendPlace

/// A surface on a parametric grid: node (i, j) is (x(i,j),
/// y(i,j), z(i,j)); drawn as a mesh one can see through.
struct Surface {
  Mat x, y, z;
};

struct Figure {
  std::string title;
  std::array<Axis, 3> axes;  ///< x, y, z
  std::vector<Series> series;
  std::vector<Surface> surfaces;  ///< 3-D only
  bool three_d = false;
  bool equal = false;  ///< one unit is equally long on all axes
  bool legend = true;  ///< shown when at least two series have labels
  LegendPlace legend_at = LegendPlace::automatic;
  bool grid = true;
  bool dark = false;  ///< light lines and texts on a dark page
  std::optional<Axis>
      right;                 ///< 2-D: a second y axis with its limits; its curves were scaled to the left one
  std::string value_label;   ///< of the scale beside cells with values
  std::vector<Rule> rules;   ///< 2-D only
  std::vector<Words> texts;  ///< 2-D only
  double tilt = 60, turn = 30;  ///< 3-D view in degrees: 0 ≤ tilt ≤ 90 (0: from above), turn about the z axis
  std::array<int, 2> size{0, 0};  ///< of a saved file in pixels (points for PDF: 3/4 of that); 0: the default
  std::vector<std::string> notes;  ///< small text under the figure; `checked` adds what could not be drawn
  std::vector<Figure> below;       ///< further checked figures on the same page, as the phase under the gain
  int columns = 1;                 ///< in which this figure and those of `below` are set, row by row
};

/// Validates and completes: lengths agree, limits are in order, something finite is left to draw. Counts the
/// points that cannot be drawn (not finite; not positive on a log axis) and says so in `notes`. Throws Error
/// that names the argument in the user's words ("x has 300 values but y has 299").
Figure checked(Figure figure);

/// May this point be drawn? All coordinates finite, and positive on log axes.
bool drawable(const Figure& figure, const Series& series, Eigen::Index i);

/// The range to show on axis 0, 1, 2: the user's, or that of
/// the drawable data with a margin. Never empty, always finite.
Range visible(const Figure& figure, int axis);

/// From the least to the greatest value of cells, or nothing.
std::optional<Range> value_range(const Figure& figure);

/// Series with labels worth a legend: at least two, and the user did not switch it off.
bool has_legend(const Figure& figure);

/// Label of an axis; the y axis of a single labelled series takes that label when it has none.
std::string axis_label(const Figure& figure, int axis);

/// "figure 'Drift': 2 curves, 602 points" — what print() shows.
std::string describe(const Figure& figure);

/// The sphere with this radius and centre as a grid of
/// latitudes × longitudes. Requires radius > 0 and finite.
Surface sphere(double radius, const std::array<double, 3>& center, int latitudes = 24, int longitudes = 48);

}  // namespace pendula::plot
