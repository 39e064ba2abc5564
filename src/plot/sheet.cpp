#include "plot/sheet.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <sys/ioctl.h>
#include <unistd.h>

#include "base/text.hpp"

namespace pendula::plot {
namespace {

const std::vector<int> dash_patterns[] = {{}, {6, 3}, {1, 2}, {6, 3, 1, 3}};
const char* const marks[] = {"●", "▲", "■", "◆", "○", "△", "□", "◇"};
constexpr int sample_cells = 6;  // of a legend entry

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value && *value;
}

Palette palette_of_environment() {
  const char* const variable = std::getenv("TERM");
  const std::string term = variable ? variable : "dumb";
  if (is_set("NO_COLOR") || term == "dumb") return Palette::none;
  return is_set("COLORTERM") || term.find("256") != std::string::npos ? Palette::ansi256 : Palette::ansi8;
}

}  // namespace

Terminal terminal_of(int descriptor) {
  Terminal t;
  if (!isatty(descriptor)) return t;
  winsize size{};
  if (ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0) {
    t.columns = size.ws_col;
    t.rows = size.ws_row;
  }
  t.palette = palette_of_environment();
  return t;
}

std::string draw(const Figure& figure, const Terminal& terminal) {
  Terminal t = terminal;
  // smaller ones have no room for numbers, larger ones are no easier to read
  t.columns = std::clamp(t.columns, 30, 120);
  t.rows = std::clamp(t.rows, 12, 60);
  std::string out = figure.three_d ? draw_solid(figure, t) : draw_flat(figure, t);
  for (const Figure& panel : figure.below) out += draw(panel, terminal);
  return out;
}

Look look(const Figure& figure, size_t k, Palette palette) {
  Look l;
  static const char* const named[] = {"", "●", "○", "■", "□", "▲", "◆", "+", "×"};  // in the order of Mark
  const Mark mark = figure.series[k].mark;
  l.mark = mark == Mark::automatic ? marks[k % 8] : named[static_cast<int>(mark)];
  if (palette == Palette::none) {
    l.pen.dashes = dash_patterns[k % 4];
    l.marked = k >= 4;
  } else {
    l.pen.colour = 1 + static_cast<int>(k % 7);
    l.pen.dashes = dash_patterns[k / 7 % 4];
  }
  if (figure.series[k].style == Style::impulses) l.pen.dashes.clear();
  return l;
}

bool draws_line(Style s) { return s == Style::line || s == Style::line_points || s == Style::steps; }
bool draws_points(Style s) { return s == Style::points || s == Style::line_points || s == Style::impulses; }

Legend::Legend(const Figure& figure, const Terminal& terminal, int columns)
    : figure_(figure), palette_(terminal.palette) {
  if (!has_legend(figure)) return;
  int used = columns + 1;
  for (size_t k = 0; k < figure.series.size(); ++k) {
    if (figure.series[k].label.empty()) continue;
    const std::string label = shortened(figure.series[k].label, columns - sample_cells - 1);
    const int width = sample_cells + 1 + static_cast<int>(characters(label).size());
    if (used + 3 + width > columns) {
      lines_.emplace_back();
      used = -3;
    }
    lines_.back().push_back({k, label, width});
    used += 3 + width;
  }
}

int Legend::width() const {
  int widest = 0;
  for (const auto& line : lines_) {
    int width = -3;
    for (const Entry& e : line) width += 3 + e.width;
    widest = std::max(widest, width);
  }
  return widest;
}

void Legend::draw(Canvas& canvas, int column, int row) const {
  for (size_t l = 0; l < lines_.size(); ++l) {
    int at = column;
    const int y = row + static_cast<int>(l);
    for (const Entry& e : lines_[l]) {
      Look l0 = look(figure_, e.series, palette_);
      const Style style = figure_.series[e.series].style;
      if (draws_line(style)) {
        const int left = 2 * at, right = 2 * (at + sample_cells) - 1, middle = 4 * y + 2;
        canvas.line(left, middle, right, middle, l0.pen, {left, middle, right, middle});
      }
      if (draws_points(style) || l0.marked) canvas.glyph(at + sample_cells / 2, y, l0.mark, l0.pen.colour);
      if (style == Style::dots) canvas.glyph(at + sample_cells / 2, y, "⠂", l0.pen.colour);
      if (style == Style::cells) canvas.glyph(at + sample_cells / 2, y, "■", l0.pen.colour);
      if (style == Style::fill) canvas.write(at + 1, y, "▒▒▒▒", l0.pen.colour);
      canvas.write(at + sample_cells + 1, y, e.label);
      at += e.width + 3;
    }
  }
}

std::string note_text(const Figure& figure, const Terminal& terminal) {
  std::string out;
  for (const std::string& line : note_lines(figure, terminal.columns))
    out += painted(line, faint, terminal.palette) + "\n";
  return out;
}

std::vector<std::string> note_lines(const Figure& figure, int columns) {
  std::vector<std::string> out;
  for (const std::string& note : figure.notes) {
    std::string line;
    int width = 0;
    size_t begin = 0;
    while (begin <= note.size()) {
      const size_t end = std::min(note.find(' ', begin), note.size());
      const std::string word = shortened(note.substr(begin, end - begin), columns);
      const int size = static_cast<int>(characters(word).size());
      if (width && width + 1 + size > columns) {
        out.push_back(line);
        line.clear();
        width = 0;
      }
      line += (width ? " " : "") + word;
      width += (width ? 1 : 0) + size;
      begin = end + 1;
    }
    out.push_back(line);
  }
  return out;
}

void Marker::operator()(double x, double y, const Clip& clip) {
  if (!(x >= clip.left - 0.5 && x <= clip.right + 0.5 && y >= clip.top - 0.5 && y <= clip.bottom + 0.5))
    return;
  const int column = std::clamp(static_cast<int>(std::lround(x)), clip.left, clip.right) / 2;
  const int row = std::clamp(static_cast<int>(std::lround(y)), clip.top, clip.bottom) / 4;
  if (std::abs(column - column_) < gap_ && std::abs(row - row_) < (gap_ + 1) / 2) return;
  canvas_.glyph(column_ = column, row_ = row, look_.mark, look_.pen.colour);
}

}  // namespace pendula::plot
