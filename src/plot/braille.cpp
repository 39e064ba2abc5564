// 2-D figures in a terminal.
//
//                        title
//   y label                    ⠤⠤ legend
//       ┌────────────────────────────────┐
//   1.0 ┤
#include "plot/braille.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "plot/sheet.hpp"
#include "plot/ticks.hpp"

namespace pendula::plot {
namespace {

using Eigen::Index;

/// The drawing area in cells (inside the frame) and how data map to its dots.
struct Frame {
  const Figure& figure;
  Range range[2];
  int left = 0, top = 0, columns = 0, rows = 0;  ///< cells

  Clip clip() const { return {2 * left, 4 * top, 2 * (left + columns) - 1, 4 * (top + rows) - 1}; }
  double x(double value) const { return 2 * left + at(0, value) * (2 * columns - 1); }
  double y(double value) const { return 4 * (top + rows) - 1 - at(1, value) * (4 * rows - 1); }

 private:
  /// Clamped to 1e9 frame sizes, so that values far outside the limits have finite dots, whose differences
  /// keep digits of a dot.
  double at(size_t axis, double value) const {
    constexpr double far = 1e9;
    return std::clamp(fraction(figure.axes[axis], range[axis], value), -far, far);
  }
};

/// Shrinks the frame until one unit has as many dots along x as along y.
void make_equal(Frame& f) {
  const double dots_x = 2 * f.columns - 1, dots_y = 4 * f.rows - 1;
  const double per_unit = std::min(dots_x / f.range[0].span(), dots_y / f.range[1].span());
  // a very narrow frame keeps room for two numbers, a very flat one for two lines of them
  f.columns = std::clamp(static_cast<int>(std::ceil((per_unit * f.range[0].span() + 1) / 2)), 6, f.columns);
  f.rows = std::clamp(static_cast<int>(std::ceil((per_unit * f.range[1].span() + 1) / 4)), 3, f.rows);
}

/// Whether to set the dot where a value has this share of its range. Ordered dither (Bayer, 1973): the share
/// is the density of dots.
bool dithered(int x, int y, double share) {
  static constexpr int order[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
  return share * 16 > order[y & 3][x & 3] + 0.5;
}

void draw_cells(Canvas& canvas, const Frame& f, const Series& s, const Look& l) {
  const Clip clip = f.clip();
  const Range values = value_range(f.figure).value_or(Range{});
  for (Index i = 0; i < s.x.size(); ++i) {
    if (!drawable(f.figure, s, i)) continue;
    const double x0 = f.x(s.x[i] - s.cell[0] / 2), x1 = f.x(s.x[i] + s.cell[0] / 2);
    const double ya = f.y(s.y[i] - s.cell[1] / 2), yb = f.y(s.y[i] + s.cell[1] / 2), y0 = std::min(ya, yb),
                 y1 = std::max(ya, yb);
    const auto dot = [](double v, int low, int high) {
      return static_cast<int>(std::clamp<double>(std::lround(v), low, high));
    };
    if (x1 < clip.left || x0 > clip.right || y1 < clip.top || y0 > clip.bottom) continue;
    for (int y = dot(y0, clip.top, clip.bottom); y <= dot(y1, clip.top, clip.bottom); ++y)
      for (int x = dot(x0, clip.left, clip.right); x <= dot(x1, clip.left, clip.right); ++x)
        if (s.value.size() == 0 || dithered(x, y, (s.value[i] - values.low) / values.span()))
          canvas.dot(x, y, l.pen.colour);
  }
}

void draw_line(Canvas& canvas, const Frame& f, const Series& s, Look& l) {
  const Clip clip = f.clip();
  Marker mark(canvas, l, mark_gap);
  for (Index i = 0; i < s.x.size(); ++i) {
    if (!drawable(f.figure, s, i)) continue;
    const double x = f.x(s.x[i]), y = f.y(s.y[i]);
    const bool joined = i > 0 && drawable(f.figure, s, i - 1) && !s.starts_at(i);
    const bool last = i + 1 == s.x.size() || !drawable(f.figure, s, i + 1) || s.starts_at(i + 1);
    if (!joined && last) {  // an isolated point between two gaps is drawn as a dot
      l.pen.travelled = 0;
      canvas.line(x, y, x, y, l.pen, clip);
    }
    if (!joined) continue;
    const double x0 = f.x(s.x[i - 1]), y0 = f.y(s.y[i - 1]);
    if (s.style == Style::steps) {
      canvas.line(x0, y0, x, y0, l.pen, clip);
      canvas.line(x, y0, x, y, l.pen, clip);
    } else {
      canvas.line(x0, y0, x, y, l.pen, clip);
    }
    if (l.marked) mark(x, y, clip);
  }
}

void draw_points(Canvas& canvas, const Frame& f, const Series& s, Look& l) {
  const Clip clip = f.clip();
  Marker mark(canvas, l, s.style == Style::points ? 0 : 2);
  const double zero = f.figure.axes[1].log ? clip.bottom : f.y(0);
  for (Index i = 0; i < s.x.size(); ++i) {
    if (!drawable(f.figure, s, i)) continue;
    if (!s.marked.empty() && !std::binary_search(s.marked.begin(), s.marked.end(), i)) continue;
    const double x = f.x(s.x[i]), y = f.y(s.y[i]);
    if (s.style == Style::impulses) canvas.line(x, zero, x, y, l.pen, clip);
    if (s.style == Style::dots)
      canvas.line(x, y, x, y, l.pen, clip);
    else
      mark(x, y, clip);
  }
}

void draw_frame(Canvas& canvas, const Frame& f) {
  const int right = f.left + f.columns, bottom = f.top + f.rows;
  for (int c = f.left; c < right; ++c)
    for (int r : {f.top - 1, bottom}) canvas.glyph(c, r, "─", faint);
  for (int r = f.top; r < bottom; ++r)
    for (int c : {f.left - 1, right}) canvas.glyph(c, r, "│", faint);
  canvas.glyph(f.left - 1, f.top - 1, "┌", faint);
  canvas.glyph(right, f.top - 1, "┐", faint);
  canvas.glyph(f.left - 1, bottom, "└", faint);
  canvas.glyph(right, bottom, "┘", faint);
}

/// Column where the number of tick k begins: centred under its tick mark, shifted where needed to stay
/// on the sheet.
int label_column(const Frame& f, const Ticks& t, size_t k, int columns) {
  const int width = width_of(t.text[k]);
  const int mark = static_cast<int>(std::lround(f.x(t.at[k]))) / 2;
  return std::clamp(mark - width / 2, 0, std::max(0, columns - width));
}

/// As many ticks as fit with two columns between neighbouring numbers; at most one in 8 columns.
Ticks fitting_ticks(const Frame& f, int columns) {
  Ticks t;
  for (int count = std::max(1, f.columns / 8); count >= 1; --count) {
    t = ticks(f.figure.axes[0], f.range[0], count);
    bool fits = true;
    std::vector<std::pair<int, int>> spans;
    for (size_t k = 0; k < t.at.size(); ++k) {
      const int begin = label_column(f, t, k, columns);
      spans.emplace_back(begin, begin + width_of(t.text[k]));
    }
    std::sort(spans.begin(), spans.end());
    for (size_t k = 1; k < spans.size(); ++k) fits = fits && spans[k].first >= spans[k - 1].second + 2;
    if (fits) break;
  }
  return t;
}

void draw_y_ticks(Canvas& canvas, const Frame& f, const Ticks& t) {
  for (size_t k = 0; k < t.at.size(); ++k) {
    const int row = static_cast<int>(std::lround(f.y(t.at[k]))) / 4;
    canvas.glyph(f.left - 1, row, "┤", faint);
    canvas.write(f.left - 2 - width_of(t.text[k]), row, t.text[k]);
  }
}

void draw_right_ticks(Canvas& canvas, const Frame& f, const Ticks& t) {
  const Range r = *f.figure.right->limits;
  for (size_t k = 0; k < t.at.size(); ++k) {
    const double share = (t.at[k] - r.low) / r.span();
    const int row = static_cast<int>(std::lround(4 * (f.top + f.rows) - 1 - share * (4 * f.rows - 1))) / 4;
    canvas.glyph(f.left + f.columns, row, "├", faint);
    canvas.write(f.left + f.columns + 2, row, t.text[k]);
  }
}

void draw_x_ticks(Canvas& canvas, const Frame& f, const Ticks& t) {
  for (size_t k = 0; k < t.at.size(); ++k) {
    canvas.glyph(static_cast<int>(std::lround(f.x(t.at[k]))) / 2, f.top + f.rows, "┬", faint);
    canvas.write(label_column(f, t, k, canvas.columns()), f.top + f.rows + 1, t.text[k]);
  }
}

void write_centred(Canvas& canvas, const Frame& f, int row, const std::string& what) {
  const int room = canvas.columns(), width = std::min(room, width_of(what));
  const int column = std::clamp(f.left + (f.columns - width) / 2, 0, room - width);
  canvas.write(column, row, shortened(what, room));
}

/// Draws both edges of an area; a terminal has no half tones to fill it with.
void draw_edges(Canvas& canvas, const Frame& f, const Series& s, Look& l) {
  Series edge = s;
  draw_line(canvas, f, edge, l);
  edge.y = s.lower.size() ? s.lower : Vec(Vec::Zero(s.y.size()));
  l.pen.travelled = 0;
  draw_line(canvas, f, edge, l);
}

void draw_rules(Canvas& canvas, const Frame& f) {
  const Clip clip = f.clip();
  Pen pen{faint, {4, 4}};
  for (const Rule& rule : f.figure.rules) {
    if (f.figure.axes[rule.axis].log && rule.at <= 0) continue;
    pen.travelled = 0;
    if (rule.axis == 1) {
      const double y = f.y(rule.at);
      canvas.line(clip.left, y, clip.right, y, pen, clip);
    } else {
      const double x = f.x(rule.at);
      canvas.line(x, clip.top, x, clip.bottom, pen, clip);
    }
  }
}

/// A text inside the frame, its left end at a cell.
void write_inside(Canvas& canvas, const Frame& f, int column, int row, const std::string& what) {
  const int width = std::min(width_of(what), f.columns);
  canvas.write(std::clamp(column, f.left, f.left + f.columns - width),
               std::clamp(row, f.top, f.top + f.rows - 1), shortened(what, width));
}

void write_texts(Canvas& canvas, const Frame& f) {
  const auto cell = [](double dots, int size) { return static_cast<int>(std::lround(dots)) / size; };
  for (const Rule& rule : f.figure.rules) {
    const bool flat = rule.axis == 1;
    const int column = flat ? f.left + f.columns - width_of(rule.label) : cell(f.x(rule.at), 2) + 1;
    if (!rule.label.empty())
      write_inside(canvas, f, column, flat ? cell(f.y(rule.at), 4) - 1 : f.top, rule.label);
  }
  for (const Words& words : f.figure.texts)
    write_inside(canvas, f, cell(f.x(words.x), 2), cell(f.y(words.y), 4), words.text);
}

void draw_series(Canvas& canvas, const Frame& f, Palette palette) {
  for (size_t k = 0; k < f.figure.series.size(); ++k) {
    const Series& s = f.figure.series[k];
    Look l = look(f.figure, k, palette);
    if (s.style == Style::cells)
      draw_cells(canvas, f, s, l);
    else if (s.style == Style::fill)
      draw_edges(canvas, f, s, l);
    else if (draws_line(s.style))
      draw_line(canvas, f, s, l);
    if (draws_points(s.style) || s.style == Style::dots) draw_points(canvas, f, s, l);
  }
}

}  // namespace

std::string draw_flat(const Figure& figure, const Terminal& terminal) {
  Frame f{figure, {visible(figure, 0), visible(figure, 1)}};
  const int columns = terminal.columns;
  const int notes = static_cast<int>(note_lines(figure, columns).size());
  // 8 rows for title, legend, numbers, label and prompt; 9/40 rows per column make a wide rectangle, 9:20
  f.rows = std::clamp(terminal.rows - 8 - notes, 6, std::max(10, columns * 9 / 40));
  // The y numbers determine the left margin; for an equal figure
  // the frame, and with it the ticks, may still shrink.
  Ticks y_ticks, right_ticks;
  int right_width = 0;
  if (figure.right) {
    right_ticks = ticks(*figure.right, *figure.right->limits, std::max(2, f.rows / 3));
    for (const std::string& s : right_ticks.text) right_width = std::max(right_width, width_of(s) + 1);
  }
  for (int pass = 0; pass < 2; ++pass) {
    y_ticks = ticks(figure.axes[1], f.range[1], std::max(2, f.rows / 3));
    int width = 0;
    for (const std::string& s : y_ticks.text) width = std::max(width, width_of(s));
    f.left = width + 2;
    f.columns = columns - f.left - 1 - right_width;
    if (figure.equal) make_equal(f);
  }
  const Ticks x_ticks = fitting_ticks(f, columns);
  const std::string y_label = shortened(labelled(axis_label(figure, 1), y_ticks), columns);
  const std::string x_label = labelled(axis_label(figure, 0), x_ticks);
  const Legend legend(figure, terminal, columns - 1);
  const int right = f.left + f.columns + 1;
  // The legend shares the line of the y label when both fit.
  const bool shared = legend.rows() == 1 && width_of(y_label) + 3 + legend.width() <= right;
  const int title_rows = figure.title.empty() ? 0 : 1;
  const int header = title_rows + legend.rows() + (y_label.empty() || shared ? 0 : 1);
  f.top = header + 1;
  const int footer = f.top + f.rows + 2 + (x_label.empty() ? 0 : 1);

  Canvas canvas(columns, footer);
  if (title_rows) write_centred(canvas, f, 0, figure.title);
  legend.draw(canvas, std::max(0, right - legend.width()), title_rows);
  canvas.write(0, header - 1, y_label);
  draw_frame(canvas, f);
  draw_y_ticks(canvas, f, y_ticks);
  if (figure.right) draw_right_ticks(canvas, f, right_ticks);
  draw_x_ticks(canvas, f, x_ticks);
  draw_rules(canvas, f);
  draw_series(canvas, f, terminal.palette);
  write_texts(canvas, f);
  if (!x_label.empty()) write_centred(canvas, f, f.top + f.rows + 2, x_label);
  return canvas.str(terminal.palette) + note_text(figure, terminal);
}

}  // namespace pendula::plot
