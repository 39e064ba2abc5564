// 3-D figures in a terminal: a box with numbered edges, surfaces as transparent nets, and curves that are
// dotted where a surface hides them.
#include <algorithm>
#include <cmath>

#include "plot/sheet.hpp"
#include "plot/ticks.hpp"
#include "plot/view.hpp"

namespace pendula::plot {
namespace {

using Eigen::Index;

struct Spot {
  double x, y;  ///< dots
};

/// Position of the picture on the sheet: dots per unit of the view, and the dot at the centre of the box.
struct Stage {
  const Figure& figure;
  const View view;
  double scale = 1, centre_x = 0, centre_y = 0;
  Clip clip{0, 0, 0, 0};

  Spot spot(const Seen& s) const { return {centre_x + scale * s.right, centre_y - scale * s.up}; }
};

/// Writes a text left (side -1) or right (+1) of a spot or centred on it (0), unless these cells are in use.
void write_beside(Canvas& canvas, Spot at, int side, int rows_below, const std::string& what) {
  const int width = width_of(what), column = static_cast<int>(std::lround(at.x)) / 2;
  const int row = static_cast<int>(std::lround(at.y)) / 4 + rows_below;
  const int begin = side < 0 ? column - width : side > 0 ? column + 1 : column - width / 2;
  const int kept = std::clamp(begin, 0, std::max(0, canvas.columns() - width));
  if (canvas.is_free(kept, row, std::min(width, canvas.columns())))
    canvas.write(kept, row, shortened(what, canvas.columns()));
}

void draw_axis(Canvas& canvas, const Stage& stage, int axis) {
  const auto a = static_cast<size_t>(axis);
  auto edge = stage.view.numbered_edge(axis);
  const auto end = [&](int sign) {
    edge[a] = sign;
    return stage.spot(stage.view.corner(edge));
  };
  const Spot low = end(-1), high = end(1);
  const double length = std::hypot(high.x - low.x, high.y - low.y);
  constexpr double shortest = 8;  // dots: two rows
  if (length < shortest) return;  // the axis points at the viewer
  const bool vertical = axis == 2;
  // dots between numbers: three rows, or nine columns where they stand side by side
  const double per_tick = vertical ? 12 : std::abs(high.x - low.x) < length / 2 ? 10 : 18;
  const Ticks t = ticks(stage.figure.axes[a], stage.view.range(axis),
                        std::clamp(static_cast<int>(length / per_tick), 2, 6));
  const Spot middle{(low.x + high.x) / 2, (low.y + high.y) / 2};
  const int side = vertical || middle.x < stage.centre_x ? -1 : 1;
  const std::string label = labelled(stage.figure.axes[a].label, t);
  if (vertical) write_beside(canvas, high, -1, -1, label);
  for (size_t k = 0; k < t.at.size(); ++k) {
    const double s = fraction(stage.figure.axes[a], stage.view.range(axis), t.at[k]);
    const Spot at{low.x + s * (high.x - low.x), low.y + s * (high.y - low.y)};
    Pen pen{faint, {}};
    if (vertical)
      canvas.line(at.x - 2, at.y, at.x, at.y, pen, stage.clip);
    else
      canvas.line(at.x, at.y, at.x + side, at.y + 2, pen, stage.clip);
    write_beside(canvas, vertical ? Spot{at.x - 2, at.y} : at, vertical ? -1 : side, vertical ? 0 : 1,
                 t.text[k]);
  }
  if (!vertical) write_beside(canvas, {middle.x + 4 * side, middle.y}, side, 2, label);
}

/// Draws a segment given in view coordinates in pieces of at most four dots, each with the pen for seen or
/// for hidden pieces.
void draw_segment(Canvas& canvas, const Stage& stage, const DepthMap& depth, const Seen& a, const Seen& b,
                  Pen& seen, Pen& hidden) {
  const double length = stage.scale * std::hypot(b.right - a.right, b.up - a.up);
  constexpr int most = 400;  // segments that reach far beyond the sheet
  const int pieces = std::clamp(static_cast<int>(length / 4) + 1, 1, most);
  const auto on = [&](double s) {
    return Seen{a.right + s * (b.right - a.right), a.up + s * (b.up - a.up), a.near + s * (b.near - a.near)};
  };
  for (int k = 0; k < pieces; ++k) {
    const Spot from = stage.spot(on(1.0 * k / pieces)), to = stage.spot(on((k + 1.0) / pieces));
    Pen& pen = depth.hides(on((k + 0.5) / pieces)) ? hidden : seen;
    canvas.line(from.x, from.y, to.x, to.y, pen, stage.clip);
  }
}

/// The nine edges of the box that do not meet at its nearest corner: solid if the edge has
/// numbers, else dotted.
void draw_box(Canvas& canvas, const Stage& stage, const DepthMap& depth) {
  const auto near = stage.view.near_end();
  for (size_t along = 0; along < 3; ++along) {
    const auto numbered = stage.view.numbered_edge(static_cast<int>(along));
    for (int p : {-1, 1})
      for (int q : {-1, 1}) {
        const size_t a = (along + 1) % 3, b = (along + 2) % 3;
        if (p == near[a] && q == near[b]) continue;
        std::array<int, 3> from{}, to{};
        from[a] = to[a] = p;
        from[b] = to[b] = q;
        from[along] = -1;
        to[along] = 1;
        const bool solid = numbered[a] == p && numbered[b] == q;
        Pen seen{faint, solid ? std::vector<int>{} : std::vector<int>{1, 2}}, hidden{faint, {0, 1}};
        draw_segment(canvas, stage, depth, stage.view.corner(from), stage.view.corner(to), seen, hidden);
      }
  }
}

/// The n for which every n-th grid line leaves about seven dots between neighbouring lines.
Index line_stride(Index lines, double dots) {
  return std::max<Index>(1,
                         static_cast<Index>(std::ceil(static_cast<double>(lines) * 7 / std::max(dots, 1.0))));
}

void draw_surface(Canvas& canvas, const Stage& stage, const DepthMap& depth, const Surface& s) {
  const auto node = [&](Index i, Index j) { return stage.view({s.x(i, j), s.y(i, j), s.z(i, j)}); };
  double low = HUGE_VAL, high = -HUGE_VAL;  // height of the surface on the screen
  for (Index i = 0; i < s.x.rows(); ++i)
    for (Index j = 0; j < s.x.cols(); ++j) {
      low = std::min(low, node(i, j).up);
      high = std::max(high, node(i, j).up);
    }
  const double dots = stage.scale * (high - low);
  const Index rows = line_stride(s.x.rows(), dots), cols = line_stride(s.x.cols(), 2 * dots);
  const auto piece = [&](const Seen& a, const Seen& b, Pen& seen, Pen& hidden) {
    if (std::isfinite(a.up + a.right + b.up + b.right))
      draw_segment(canvas, stage, depth, a, b, seen, hidden);
  };
  for (Index i = 0; i < s.x.rows(); i += rows) {
    Pen seen{faint, {1, 1}}, hidden{faint, {1, 5}};
    for (Index j = 0; j + 1 < s.x.cols(); ++j) piece(node(i, j), node(i, j + 1), seen, hidden);
  }
  for (Index j = 0; j < s.x.cols(); j += cols) {
    Pen seen{faint, {1, 1}}, hidden{faint, {1, 5}};
    for (Index i = 0; i + 1 < s.x.rows(); ++i) piece(node(i, j), node(i + 1, j), seen, hidden);
  }
}

void draw_curve(Canvas& canvas, const Stage& stage, const DepthMap& depth, size_t k, Palette palette) {
  const Series& s = stage.figure.series[k];
  Look l = look(stage.figure, k, palette);
  Pen hidden = l.pen;
  hidden.dashes = {1, 2};
  Marker mark(canvas, l, s.style == Style::points ? 0 : l.marked && s.style == Style::line ? mark_gap : 2);
  const auto node = [&](Index i) { return stage.view({s.x[i], s.y[i], s.z[i]}); };
  for (Index i = 0; i < s.x.size(); ++i) {
    if (!drawable(stage.figure, s, i)) continue;
    const Seen here = node(i);
    const Spot at = stage.spot(here);
    if (draws_line(s.style) && i > 0 && drawable(stage.figure, s, i - 1))
      draw_segment(canvas, stage, depth, node(i - 1), here, l.pen, hidden);
    if (s.style == Style::impulses)
      draw_segment(canvas, stage, depth, stage.view({s.x[i], s.y[i], std::max(0.0, stage.view.range(2).low)}),
                   here, l.pen, hidden);
    if (draws_points(s.style) || (l.marked && s.style == Style::line))
      mark(at.x, at.y, stage.clip);
    else if (!draws_line(s.style))
      canvas.line(at.x, at.y, at.x, at.y, l.pen, stage.clip);
  }
}

}  // namespace

std::string draw_solid(const Figure& figure, const Terminal& terminal) {
  Stage stage{figure, View(figure)};
  const int columns = terminal.columns;
  const Legend legend(figure, terminal, columns - 1);
  const int header = (figure.title.empty() ? 0 : 1) + legend.rows();
  const int footer = static_cast<int>(note_lines(figure, columns).size());
  constexpr int above = 1, below = 3, beside = 11;  // cells around the box for numbers and labels

  const Extent box = stage.view.extent();
  // 2/5 rows per column: 4:5 dots, nearly a square
  const int most = std::clamp(terminal.rows - header - footer - 2, 10, std::max(12, columns * 2 / 5));
  stage.scale = std::min((columns - 2 * beside) / box.right, 2.0 * (most - above - below) / box.up);
  const int rows = std::min(most, static_cast<int>(std::ceil(stage.scale * box.up / 2)) + above + below);
  stage.centre_x = columns;
  stage.centre_y = 4 * (header + above) + stage.scale * box.up;
  stage.clip = {0, 4 * header, 2 * columns - 1, 4 * (header + rows) - 1};

  Canvas canvas(columns, header + rows);
  const std::string title = shortened(figure.title, columns);
  canvas.write((columns - width_of(title)) / 2, 0, title);
  legend.draw(canvas, std::max(0, (columns - legend.width()) / 2), header - legend.rows());
  const DepthMap depth(figure, stage.view);
  for (int axis : {2, 0, 1}) draw_axis(canvas, stage, axis);
  draw_box(canvas, stage, depth);
  for (const Surface& s : figure.surfaces) draw_surface(canvas, stage, depth, s);
  for (size_t k = 0; k < figure.series.size(); ++k) draw_curve(canvas, stage, depth, k, terminal.palette);
  return canvas.str(terminal.palette) + note_text(figure, terminal);
}

}  // namespace pendula::plot
