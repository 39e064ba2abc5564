#include "plot/figure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::plot {
namespace {

using Eigen::Index;

const char* const axis_names[] = {"x", "y", "z"};

double coordinate(const Series& s, int axis, Index i) {
  return axis == 0 ? s.x[i] : axis == 1 ? s.y[i] : s.z[i];
}

int dimensions(const Figure& f) { return f.three_d ? 3 : 2; }

/// "'C1'", "series 2", or "the data" when there is only one.
std::string called(const Figure& f, size_t k) {
  if (!f.series[k].label.empty()) return "'" + f.series[k].label + "'";
  return f.series.size() == 1 ? "the data" : text("series ", k + 1);
}

std::string values(Index n) { return text(n, n == 1 ? " value" : " values"); }

void check_lengths(const Figure& f, size_t k) {
  const Series& s = f.series[k];
  const std::string where = f.series.size() > 1 ? " (" + called(f, k) + ")" : "";
  if (s.x.size() != s.y.size())
    throw Error(text("x has ", values(s.x.size()), " but y has ", s.y.size(), where));
  if (f.three_d && s.z.size() != s.x.size())
    throw Error(text("x has ", values(s.x.size()), " but z has ", s.z.size(), where));
  if (s.lower.size() != 0 && s.lower.size() != s.y.size())
    throw Error(
        text("the upper edge has ", values(s.y.size()), " but the lower one has ", s.lower.size(), where));
  if (s.value.size() != 0 && s.value.size() != s.x.size())
    throw Error(text("there are ", s.value.size(), " colours for ", values(s.x.size()), where));
  if (s.x.size() == 0)
    throw Error("nothing to draw: " + called(f, k) +
                (k || f.series.size() > 1 || !s.label.empty() ? " has" : " have") + " no points");
}

void check_surface(const Surface& s, size_t k) {
  if (s.x.rows() != s.y.rows() || s.x.rows() != s.z.rows() || s.x.cols() != s.y.cols() ||
      s.x.cols() != s.z.cols())
    throw Error(text("surface ", k + 1, ": x, y and z must be grids of the same size, but they are ",
                     s.x.rows(), "×", s.x.cols(), ", ", s.y.rows(), "×", s.y.cols(), " and ", s.z.rows(), "×",
                     s.z.cols()));
  if (s.x.rows() < 2 || s.x.cols() < 2)
    throw Error(text("surface ", k + 1, ": a grid needs at least 2×2 nodes, this one has ", s.x.rows(), "×",
                     s.x.cols()));
}

constexpr int least_pixels = 100, most_pixels = 10'000;  // room for numbers; 300 MB of pixels

void check_axes(const Figure& f) {
  for (int a = 0; a < dimensions(f); ++a) {
    const Axis& axis = f.axes[a];
    if (f.three_d && axis.log)
      throw Error("logarithmic axes exist in 2-D figures only; plot3 the logarithm instead");
    if (!axis.limits) continue;
    const auto [low, high] = *axis.limits;
    const std::string what = text(axis_names[a], "lim = {", shortest(low), ", ", shortest(high), "}");
    if (!std::isfinite(low) || !std::isfinite(high))
      throw Error(what + ": both limits must be finite numbers");
    if (!(low < high)) throw Error(what + ": the first limit must be below the second");
    if (axis.log && low <= 0) throw Error(what + ": limits of a logarithmic axis must be positive");
  }
  if (!(f.tilt >= 0 && f.tilt <= 90) || !std::isfinite(f.turn))
    throw Error(
        text("view = {", shortest(f.tilt), ", ", shortest(f.turn),
             "}: the tilt must lie between 0 (from above) and 90 degrees, the turn be a number of degrees"));
  for (const Rule& rule : f.rules)
    if (!std::isfinite(rule.at)) throw Error("a line across the figure needs a finite position");
  if (f.right && !(f.right->limits && f.right->limits->low < f.right->limits->high))
    throw Error("y2lim: the first limit must be below the second");
  for (int n : f.size)
    if (n && (n < least_pixels || n > most_pixels))
      throw Error(text("size = {", f.size[0], ", ", f.size[1], "}: width and height must lie between ",
                       least_pixels, " and ", most_pixels, " pixels"));
}

/// Counts the points of series k that can be drawn and adds a note with the reasons for the others.
Index count_gaps(Figure& f, size_t k) {
  const Series& s = f.series[k];
  Index infinite = 0, negative[2] = {0, 0}, good = 0;
  for (Index i = 0; i < s.x.size(); ++i) {
    bool finite = true;
    for (int a = 0; a < dimensions(f); ++a) finite = finite && std::isfinite(coordinate(s, a, i));
    if (!finite)
      ++infinite;
    else if (f.axes[0].log && s.x[i] <= 0)
      ++negative[0];
    else if (f.axes[1].log && s.y[i] <= 0)
      ++negative[1];
    else
      ++good;
  }
  if (infinite)
    f.notes.push_back(text(infinite, " of ", s.x.size(), " points of ", called(f, k),
                           infinite == 1 ? " is" : " are", " not finite (drawn as gaps)"));
  for (int a = 0; a < 2; ++a)
    if (negative[a])
      f.notes.push_back(text(negative[a], " of ", s.x.size(), " points of ", called(f, k),
                             negative[a] == 1 ? " is" : " are", " not positive: no place on the logarithmic ",
                             axis_names[a], " axis"));
  return good;
}

void check_something_to_draw(Figure& f) {
  if (f.series.empty() && f.surfaces.empty()) throw Error("nothing to draw: the figure has no series");
  Index good = 0, all = 0;
  for (size_t k = 0; k < f.series.size(); ++k) {
    good += count_gaps(f, k);
    all += f.series[k].x.size();
  }
  for (const Surface& s : f.surfaces)
    good += (s.x.array().isFinite() && s.y.array().isFinite() && s.z.array().isFinite()).count();
  if (good) return;
  for (int a = 0; a < 2; ++a)
    if (f.axes[a].log)
      throw Error(text("nothing to draw: the ", axis_names[a], " axis is logarithmic, but none of the ", all,
                       " points has a positive finite ", axis_names[a], "; use ",
                       f.axes[1 - a].log ? (a ? "semilogx" : "semilogy") : "plot", " instead"));
  throw Error(text("nothing to draw: ", all == 1 ? "the only point is" : text("all ", all, " points are"),
                   " NaN or infinite"));
}

bool inside(const Figure& f, const Series& s, Index i, int except) {
  for (int a = 0; a < dimensions(f); ++a)
    if (a != except && f.axes[a].limits) {
      const double v = coordinate(s, a, i);
      if (v < f.axes[a].limits->low || v > f.axes[a].limits->high) return false;
    }
  return true;
}

bool near(double value, Range r) {
  // a line across the figure widens it threefold at most; values that hardly vary have a span of 10 % of them
  const double room = 2 * std::max(r.span(), 0.1 * std::max(std::abs(r.low), std::abs(r.high)));
  return value >= r.low - room && value <= r.high + room;
}

/// Range of the drawable data along one axis; `limited`: only points inside the limits of the other axes.
std::optional<Range> extent(const Figure& f, int axis, bool limited) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Range r{inf, -inf};
  const auto take = [&](double v) {
    r.low = std::min(r.low, v);
    r.high = std::max(r.high, v);
  };
  for (const Series& s : f.series) {
    bool any = false;
    for (Index i = 0; i < s.x.size(); ++i)
      if (drawable(f, s, i) && (!limited || inside(f, s, i, axis))) {
        take(coordinate(s, axis, i));
        any = true;
      }
    if (axis == 1 && s.style == Style::fill)
      for (Index i = 0; i < s.lower.size(); ++i)
        if (std::isfinite(s.lower[i]) && drawable(f, s, i)) take(s.lower[i]);
    if (any && s.style == Style::fill && s.lower.size() == 0 && axis == 1 && !f.axes[axis].log) take(0);
    if (any && s.style == Style::impulses && axis == dimensions(f) - 1 && !f.axes[axis].log) take(0);
  }
  for (const Surface& s : f.surfaces) {
    const Mat& m = axis == 0 ? s.x : axis == 1 ? s.y : s.z;
    for (Index i = 0; i < m.size(); ++i)
      if (std::isfinite(m.data()[i])) take(m.data()[i]);
  }
  if (!(r.low <= r.high)) return std::nullopt;
  for (const Rule& rule : f.rules)  // include a bound in the range, unless it would compress the data
    if (rule.axis == axis && (!f.axes[axis].log || rule.at > 0) && near(rule.at, r)) take(rule.at);
  return r;
}

bool is_tight(const Figure& f, int axis) {
  return !f.three_d && axis == 0 && !f.equal &&
         std::all_of(f.series.begin(), f.series.end(), [](const Series& s) {
           return s.style == Style::line || s.style == Style::steps || s.style == Style::fill;
         });
}

/// Index of a name in a list of allowed names.
size_t position_of(const std::string& name, const std::vector<std::string>& names, const char* what,
                   const char* list) {
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end())
    throw Error(text("unknown ", what, " '", name, "'.", did_you_mean(name, names), " ", list,
                     std::string(list).find(':') == std::string::npos ? ": " : " ", join(names, ", ")));
  return static_cast<size_t>(it - names.begin());
}

/// The range enlarged by `margin` of its span at each end; a constant c gets c ± 5 % (0: ± 1).
Range widened(Range r, bool log, double margin) {
  if (log) {
    const double decades = std::log10(r.high) - std::log10(r.low);
    constexpr double constant = 1e-9;  // values that are equal but for rounding get half a decade
    const double pad = decades < constant ? 0.5 : margin * decades;
    return {std::max(r.low * std::pow(10, -pad), std::numeric_limits<double>::min()),
            std::min(r.high * std::pow(10, pad), std::numeric_limits<double>::max())};
  }
  const double size = std::max(std::abs(r.low), std::abs(r.high));
  if (!std::isfinite(r.span()) || size > 1 / least_size)
    throw Error(text("the values reach from ", rounded(r.low, 3), " to ", rounded(r.high, 3),
                     ", too far for a linear axis; set xlim or ylim, or use semilogy"));
  constexpr double rounding = 1e-13;  // 450 ε: numbers on the axis would differ beyond the 13th digit
  if (size < least_size) return {-1, 1};
  if (r.span() <= rounding * size) return {r.low - 0.05 * size, r.high + 0.05 * size};
  const double pad = margin * r.span();
  return {r.low - pad, r.high + pad};
}

/// The limits given by the user, or the range of the data.
Range range_of_data(const Figure& f, int axis) {
  if (f.axes[axis].limits) return *f.axes[axis].limits;
  auto r = extent(f, axis, true);
  if (!r) r = extent(f, axis, false);
  return widened(r.value_or(Range{}), f.axes[axis].log, is_tight(f, axis) ? 0 : f.three_d ? 0.02 : 0.04);
}

}  // namespace

const std::vector<std::string>& style_names() {
  static const std::vector<std::string> names{"line",  "points", "line+points", "dots", "impulses",
                                              "steps", "cells",  "fill"};  // in the order of Style
  return names;
}

const std::vector<std::string>& dash_names() {
  static const std::vector<std::string> names{"auto", "solid", "dashed", "dotted", "dashdot"};
  return names;
}

const std::vector<std::string>& mark_names() {
  static const std::vector<std::string> names{"auto",     "circle",  "ring", "square", "box",
                                              "triangle", "diamond", "plus", "cross"};
  return names;
}

const std::vector<std::string>& legend_places() {
  static const std::vector<std::string> names{"auto",         "none",  "top left", "top right", "bottom left",
                                              "bottom right", "above", "right",    "below"};
  return names;
}

Style style_named(const std::string& name) {
  return static_cast<Style>(position_of(name, style_names(), "style", "Styles"));
}
Dash dash_named(const std::string& name) {
  return static_cast<Dash>(position_of(name, dash_names(), "dash", "Dashes"));
}
Mark mark_named(const std::string& name) {
  return static_cast<Mark>(position_of(name, mark_names(), "marker", "Markers"));
}
LegendPlace legend_place_named(const std::string& name) {
  return static_cast<LegendPlace>(position_of(name, legend_places(), "legend place", "Places"));
}

std::string colour_named(const std::string& name) {
  static const std::vector<std::string> names{"blue", "red",   "green", "purple", "orange",
                                              "sky",  "black", "grey",  "yellow"};
  static const char* const values[] = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00",
                                       "#56B4E9", "#000000", "#808080", "#F0E442"};
  const bool hexadecimal = name.size() == 7 && name[0] == '#' &&
                           name.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
  if (hexadecimal) return name;
  if (name == "gray") return values[7];
  return values[position_of(name, names, "colour", "Colours: \"#rrggbb\" and")];
}

bool drawable(const Figure& f, const Series& s, Index i) {
  for (int a = 0; a < dimensions(f); ++a) {
    const double v = coordinate(s, a, i);
    if (!std::isfinite(v) || (f.axes[a].log && v <= 0)) return false;
  }
  return true;
}

Figure checked(Figure f) {
  check_axes(f);
  for (size_t k = 0; k < f.series.size(); ++k) check_lengths(f, k);
  for (size_t k = 0; k < f.surfaces.size(); ++k) check_surface(f.surfaces[k], k);
  if (!f.surfaces.empty() && !f.three_d) throw Error("surfaces belong to 3-D figures; use plot3");
  check_something_to_draw(f);
  // report bad limits here rather than when the figure is drawn
  for (int a = 0; a < dimensions(f); ++a) visible(f, a);
  return f;
}

Range visible(const Figure& f, int axis) {
  Range own = range_of_data(f, axis);
  if (!f.equal || f.three_d || f.axes[axis].limits) return own;
  // of the other side; a vertical line with equal axes needs a frame of some width
  constexpr double narrowest = 0.3;  // a choice
  const double missing = narrowest * range_of_data(f, 1 - axis).span() - own.span();
  if (missing > 0) own = {own.low - missing / 2, own.high + missing / 2};
  return own;
}

bool has_legend(const Figure& f) {
  const auto labelled =
      std::count_if(f.series.begin(), f.series.end(), [](const Series& s) { return !s.label.empty(); });
  return f.legend && labelled > 0 && (f.series.size() > 1 || f.legend_at != LegendPlace::automatic);
}

std::optional<Range> value_range(const Figure& f) {
  std::optional<Range> range;
  for (const Series& s : f.series)
    for (double v : s.value) {
      if (!std::isfinite(v)) continue;
      if (!range) range = Range{v, v};
      range->low = std::min(range->low, v);
      range->high = std::max(range->high, v);
    }
  if (range && !(range->low < range->high)) range->high = range->low + std::max(1.0, std::abs(range->low));
  return range;
}

std::string axis_label(const Figure& f, int axis) {
  const bool value_axis = axis == 1 && !f.three_d;
  if (f.axes[axis].label.empty() && value_axis && f.series.size() == 1) return f.series[0].label;
  return f.axes[axis].label;
}

std::string describe(const Figure& f) {
  Index points = 0;
  for (const Series& s : f.series) points += s.x.size();
  std::string out = f.three_d ? "3-D figure" : "figure";
  if (!f.title.empty()) out += " '" + f.title + "'";
  std::vector<std::string> parts;
  if (!f.series.empty()) {
    parts.push_back(text(f.series.size(), " series"));
    parts.push_back(text(points, points == 1 ? " point" : " points"));
  }
  if (!f.surfaces.empty())
    parts.push_back(text(f.surfaces.size(), f.surfaces.size() == 1 ? " surface" : " surfaces"));
  if (!f.below.empty()) parts.push_back(text(f.below.size() + 1, " panels"));
  return out + ": " + join(parts, ", ");
}

Surface sphere(double radius, const std::array<double, 3>& center, int latitudes, int longitudes) {
  if (!(radius > 0) || !std::isfinite(radius))
    throw Error(text("the radius must be a positive number, got ", shortest(radius)));
  for (double c : center)
    if (!std::isfinite(c)) throw Error("the center must be three finite numbers");
  Surface s;
  s.x = s.y = s.z = Mat(latitudes + 1, longitudes + 1);
  for (int i = 0; i <= latitudes; ++i)
    for (int j = 0; j <= longitudes; ++j) {
      const double polar = std::numbers::pi * i / latitudes, around = 2 * std::numbers::pi * j / longitudes;
      s.x(i, j) = center[0] + radius * std::sin(polar) * std::cos(around);
      s.y(i, j) = center[1] + radius * std::sin(polar) * std::sin(around);
      s.z(i, j) = center[2] + radius * std::cos(polar);
    }
  return s;
}

}  // namespace pendula::plot
