// 3-D figures as gnuplot scripts. Projection, hiding and drawing order are computed here (view.hpp), so that
// a file shows what the terminal shows; gnuplot gets plain lines and polygons: back walls with their grid,
// what is behind a surface, the surface as a translucent skin, its net, what is before it.
#include "plot/script.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "base/text.hpp"
#include "plot/canvas.hpp"
#include "plot/ticks.hpp"
#include "plot/view.hpp"

namespace pendula::plot {
namespace {

using Eigen::Index;

/// The pieces of one picture, drawn in the order in which they are added.
class Picture {
 public:
  /// `style`: the text after the name of the data block.
  void add(const Block& block, const std::string& style) {
    if (block.empty()) return;
    data_ += block.str();
    plots_ += (plots_.empty() ? "plot " : ", \\\n     ") + block.name() + " using 1:2 " + style;
  }
  Block block() { return Block(text("$part", ++blocks_)); }
  /// A text with its `anchor` ("left", "center", "right") at a point of the screen plane, turned
  /// by `angle` degrees.
  void label(double x, double y, const std::string& words, const std::string& anchor, double angle = 0) {
    labels_ += text("set label ", ++count_, " ", quoted(words), " at ", rounded(x, 8), ",", rounded(y, 8),
                    " ", anchor, angle == 0 ? "" : " rotate by " + rounded(angle, 5),
                    " textcolor '#333333' noenhanced\n");
  }
  std::string str() const { return labels_ + data_ + plots_ + "\n"; }

 private:
  std::string data_, plots_, labels_;
  int blocks_ = 0, count_ = 0;
};

std::string line_style(const std::string& colour, double width) {
  return "with lines linewidth " + rounded(width, 3) + " linecolor rgb '" + colour + "' notitle";
}

void segment(Block& block, const Seen& a, const Seen& b) {
  block.row(a.right, a.up);
  block.row(b.right, b.up);
  block.gap();
}

/// The three walls behind the data with a line at each tick, and the edges that carry numbers.
void add_box(Picture& picture, const View& view, const std::array<Ticks, 3>& numbers) {
  const auto near = view.near_end();
  Block walls = picture.block(), grid = picture.block(), edges = picture.block();
  for (size_t wall = 0; wall < 3; ++wall) {  // index of the coordinate that is at its far end on this wall
    const size_t a = (wall + 1) % 3, b = (wall + 2) % 3;
    std::array<int, 3> at{};
    at[wall] = -near[wall];
    for (const auto& [p, q] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {-1, -1}}) {
      at[a] = p;
      at[b] = q;
      const Seen c = view.corner(at);
      walls.row(c.right, c.up);
    }
    walls.gap();
    for (const auto& [along, across] : {std::pair{a, b}, {b, a}})
      for (double value : numbers[along].at) {
        Point3 from, to;
        for (size_t k = 0; k < 3; ++k) from[k] = to[k] = 0.5 * view.side(static_cast<int>(k)) * at[k];
        const Range& r = view.range(static_cast<int>(along));
        from[along] = to[along] = view.side(static_cast<int>(along)) * ((value - r.low) / r.span() - 0.5);
        to[across] = -from[across];
        segment(grid, view.rotated(from), view.rotated(to));
      }
  }
  for (int axis = 0; axis < 3; ++axis) {
    auto from = view.numbered_edge(axis), to = from;
    from[axis] = -1;
    to[axis] = 1;
    segment(edges, view.corner(from), view.corner(to));
  }
  picture.add(walls,
              "with filledcurves closed fillcolor rgb '#F7F7F7' fillstyle solid "
              "border linecolor rgb '#D0D0D0' notitle");
  picture.add(grid, line_style("#DDDDDD", 0.6));
  picture.add(edges, line_style("#666666", 1));
}

/// Numbers and label of one axis, outside its edge. letters: size of the letters relative to those in a
/// picture 640 pixels high, the default height.
void add_axis(Picture& picture, const View& view, int axis, const std::string& name, const Ticks& t,
              double letters) {
  const auto a = static_cast<size_t>(axis);
  auto edge = view.numbered_edge(axis);
  edge[a] = -1;
  const Seen low = view.corner(edge);
  edge[a] = 1;
  const Seen high = view.corner(edge);
  const double dx = high.right - low.right, dy = high.up - low.up, length = std::hypot(dx, dy);
  // lengths in units of the box, which is about 1: marks of 2 %, numbers 5 % and labels 12 % from the edge
  if (length < 0.1) return;                    // the axis points at the viewer
  double nx = dy / length, ny = -dx / length;  // across the edge, away from the centre of the picture
  if (nx * (low.right + high.right) + ny * (low.up + high.up) < 0) {
    nx = -nx;
    ny = -ny;
  }
  const std::string anchor = nx < -0.5 ? "right" : nx > 0.5 ? "left" : "center";
  Block marks = picture.block();
  size_t widest = 0;
  for (size_t k = 0; k < t.at.size(); ++k) {
    const double s = (t.at[k] - view.range(axis).low) / view.range(axis).span();
    const double x = low.right + s * dx, y = low.up + s * dy;
    segment(marks, {x, y, 0}, {x + 0.02 * nx, y + 0.02 * ny, 0});
    picture.label(x + 0.05 * letters * nx, y + 0.05 * letters * ny, t.text[k], anchor);
    widest = std::max(widest, t.text[k].size());
  }
  picture.add(marks, line_style("#666666", 1));
  const std::string words = labelled(name, t);
  if (words.empty()) return;
  double angle = characters(words).size() < 3 ? 0 : std::atan2(dy, dx) * 180 / std::numbers::pi;
  // text is read from the left; half a degree keeps a vertical label from turning over by rounding
  if (angle > 90.5) angle -= 180;
  if (angle < -89.5) angle += 180;
  const double away = letters * (anchor == "center" ? 0.14 : 0.12 + 0.018 * static_cast<double>(widest));
  picture.label((low.right + high.right) / 2 + away * nx, (low.up + high.up) / 2 + away * ny, words, "center",
                angle);
}

struct Quad {
  std::array<Seen, 4> node;
  double near;
};

/// Draws about twenty lines of a finer grid.
Index net_stride(Index lines) { return std::max<Index>(1, (lines + 18) / 20); }

/// A translucent grey skin: all facets from back to front, then the visible part of the net.
void add_surfaces(Picture& picture, const Figure& f, const View& view, const DepthMap& depth) {
  std::vector<Quad> quads;
  Block net = picture.block(), hidden = picture.block(), skin = picture.block();
  const auto line = [&](const Seen& a, const Seen& b) {
    if (!std::isfinite(a.up + a.right + b.up + b.right)) return;
    const Seen middle{(a.right + b.right) / 2, (a.up + b.up) / 2, (a.near + b.near) / 2};
    segment(depth.hides(middle) ? hidden : net, a, b);
  };
  for (const Surface& s : f.surfaces)
    for (Index i = 0; i < s.x.rows(); ++i)
      for (Index j = 0; j < s.x.cols(); ++j) {
        const auto node = [&](Index r, Index c) { return view({s.x(r, c), s.y(r, c), s.z(r, c)}); };
        const bool down = i + 1 < s.x.rows(), across = j + 1 < s.x.cols();
        if (across && (i % net_stride(s.x.rows()) == 0 || !down)) line(node(i, j), node(i, j + 1));
        if (down && (j % net_stride(s.x.cols()) == 0 || !across)) line(node(i, j), node(i + 1, j));
        if (!down || !across) continue;
        Quad q{{node(i, j), node(i, j + 1), node(i + 1, j + 1), node(i + 1, j)}, 0};
        for (const Seen& n : q.node) q.near += n.near;
        if (std::isfinite(q.near)) quads.push_back(q);
      }
  std::stable_sort(quads.begin(), quads.end(), [](const Quad& a, const Quad& b) { return a.near < b.near; });
  for (const Quad& q : quads) {
    for (const Seen& n : q.node) skin.row(n.right, n.up);
    skin.row(q.node[0].right, q.node[0].up);
    skin.gap();
  }
  picture.add(hidden, line_style("#D5D5D5", 0.5));
  picture.add(skin, "with filledcurves closed fillcolor rgb '" + translucent("#808080", 0.16) +
                        "' fillstyle solid noborder notitle");
  picture.add(net, line_style("#A8A8A8", 0.6));
}

/// Splits a curve into two blocks, hidden and not hidden by surfaces, in short pieces if the
/// figure has surfaces.
void split_curve(const Figure& f, const Series& s, const View& view, const DepthMap& depth, Block& seen,
                 Block& hidden) {
  Index before = -1;
  for (Index i : thinned(f, s)) {
    constexpr double piece = 0.02;  // of the box: some three raster points of the depth map
    if (i >= 0 && before >= 0) {
      const Seen a = view({s.x[before], s.y[before], s.z[before]}), b = view({s.x[i], s.y[i], s.z[i]});
      const double length = std::hypot(b.right - a.right, b.up - a.up);
      const int pieces = f.surfaces.empty() ? 1 : std::clamp(static_cast<int>(length / piece) + 1, 1, 100);
      for (int k = 0; k < pieces; ++k) {
        const auto on = [&](double r) {
          return Seen{a.right + r * (b.right - a.right), a.up + r * (b.up - a.up),
                      a.near + r * (b.near - a.near)};
        };
        const Seen from = on(1.0 * k / pieces), to = on((k + 1.0) / pieces);
        const bool behind = depth.hides(on((k + 0.5) / pieces));
        Block& into = behind ? hidden : seen;
        (behind ? seen : hidden).gap();
        if (!into.is_open()) into.row(from.right, from.up);
        into.row(to.right, to.up);
      }
    } else {
      seen.gap();
      hidden.gap();
    }
    before = i;
  }
}

/// With surfaces, the first curve is black, as in textbooks, and the palette begins with the second one.
std::string curve_colour(const Figure& f, size_t k) {
  if (f.surfaces.empty()) return series_colour(k);
  return k == 0 ? "#000000" : series_colour(k - 1);
}

void add_curve(Picture& picture, const Figure& f, const View& view, size_t k, const Block& seen) {
  const Series& s = f.series[k];
  const std::string title = s.label.empty() ? " notitle" : " title " + quoted(s.label);
  const std::string colour = " linecolor rgb '" + curve_colour(f, k) + "'";
  picture.add(seen, "with lines linewidth 1.8" + colour + title);
  if (s.style == Style::line || s.style == Style::steps) return;
  Block points = picture.block(), feet = picture.block();
  for (Index i : thinned(f, s)) {
    if (i < 0) continue;
    const Seen p = view({s.x[i], s.y[i], s.z[i]});
    points.row(p.right, p.up);
    if (s.style == Style::impulses)
      segment(feet, view({s.x[i], s.y[i], std::max(0.0, view.range(2).low)}), p);
  }
  picture.add(feet, line_style(curve_colour(f, k), 1.2));
  const std::string size = s.style == Style::dots ? "0.15" : "0.6";
  picture.add(points,
              "with points pointtype 7 pointsize " + size + colour + (seen.empty() ? title : " notitle"));
}

}  // namespace

std::string solid_script(const Figure& f) {
  const View view(f);
  const DepthMap depth(f, view);
  Picture picture;
  std::array<Ticks, 3> numbers;
  const double letters = f.size[1] > 0 ? std::max(1.0, 640.0 / f.size[1]) : 1.0;
  for (int a = 0; a < 3; ++a) {
    const int count = std::clamp(static_cast<int>(7 * view.side(a) / letters), 2, 6);
    numbers[a] = ticks(f.axes[a], view.range(a), count);
  }
  add_box(picture, view, numbers);
  for (int a = 0; a < 3; ++a) add_axis(picture, view, a, f.axes[a].label, numbers[a], letters);

  std::vector<Block> seen;
  for (size_t k = 0; k < f.series.size(); ++k) {
    const Series& s = f.series[k];
    seen.push_back(picture.block());
    Block hidden = picture.block();
    if (s.style == Style::line || s.style == Style::line_points || s.style == Style::steps)
      split_curve(f, s, view, depth, seen.back(), hidden);
    picture.add(hidden, line_style(translucent(curve_colour(f, k), 0.75), 1.2));
  }
  add_surfaces(picture, f, view, depth);
  for (size_t k = 0; k < f.series.size(); ++k) add_curve(picture, f, view, k, seen[k]);

  const Extent e = view.extent();
  std::string out = "unset border\nunset tics\nset size ratio -1\n";
  out += text("set xrange [", rounded(-e.right - 0.28 * letters, 8), ":",
              rounded(e.right + 0.28 * letters, 8), "]\n");
  out += text("set yrange [", rounded(-e.up - 0.14 * letters, 8), ":", rounded(e.up + 0.06, 8), "]\n");
  out += text("set lmargin 1\nset rmargin 1\nset bmargin ", 1 + f.notes.size(), "\n");
  out += has_legend(f) ? "set key top right vertical Left reverse noenhanced samplen 2.5 spacing 1.15\n"
                       : "unset key\n";
  return out + note_labels(f) + picture.str();
}

}  // namespace pendula::plot
