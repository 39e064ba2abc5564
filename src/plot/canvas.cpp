#include "plot/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/text.hpp"

namespace pendula::plot {
namespace {

/// Bit of the dot in column x, row y of a braille cell (Unicode 2800: dots 1-3 and 7 left, 4-6 and 8 right).
constexpr std::uint8_t braille_bit[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};

std::string braille(std::uint8_t dots) {  // U+2800 + dots in UTF-8
  return {'\xE2', static_cast<char>(0xA0 | dots >> 6), static_cast<char>(0x80 | (dots & 0x3F))};
}

/// Colours that colour-blind readers can distinguish (Okabe & Ito 2008), approximated by those
/// of the terminal.
std::string escape(int colour, Palette palette) {
  static const int ansi256[] = {33, 208, 35, 170, 220, 75, 160}, ansi8[] = {34, 31, 32, 35, 33, 36, 37};
  if (colour == ink) return "\x1b[0m";
  if (colour == faint) return palette == Palette::ansi256 ? "\x1b[38;5;244m" : "\x1b[2m";
  const int k = (colour - 1) % 7;
  return palette == Palette::ansi256 ? "\x1b[38;5;" + std::to_string(ansi256[k]) + "m"
                                     : "\x1b[" + std::to_string(ansi8[k]) + "m";
}

/// Cuts the segment at the rectangle widened by one dot (Liang & Barsky 1984). False: nothing is left.
bool cut(double& x0, double& y0, double& x1, double& y1, const Clip& clip) {
  const double dx = x1 - x0, dy = y1 - y0;
  double enter = 0, leave = 1;
  const auto edge = [&](double direction, double distance) {
    if (direction == 0) return distance >= 0;
    const double at = distance / direction;
    if (direction < 0)
      enter = std::max(enter, at);
    else
      leave = std::min(leave, at);
    return enter <= leave;
  };
  if (!edge(-dx, x0 - (clip.left - 1)) || !edge(dx, clip.right + 1 - x0) || !edge(-dy, y0 - (clip.top - 1)) ||
      !edge(dy, clip.bottom + 1 - y0))
    return false;
  x1 = x0 + leave * dx;
  y1 = y0 + leave * dy;
  x0 += enter * dx;
  y0 += enter * dy;
  return true;
}

bool is_combining(std::string_view c) { return display_width(c) == 0; }

}  // namespace

bool Pen::down() const {
  if (dashes.empty()) return true;
  long at = travelled % std::accumulate(dashes.begin(), dashes.end(), 0L);
  for (size_t k = 0; k < dashes.size(); ++k) {
    if (at < dashes[k]) return k % 2 == 0;
    at -= dashes[k];
  }
  return true;
}

Canvas::Canvas(int columns, int rows)
    : columns_(columns), rows_(rows), cells_(static_cast<size_t>(columns) * static_cast<size_t>(rows)) {}

void Canvas::dot(int x, int y, int colour) {
  if (x < 0 || y < 0 || !has(x / 2, y / 4)) return;
  Cell& cell = at(x / 2, y / 4);
  cell.dots |= braille_bit[y % 4][x % 2];
  if (cell.glyph.empty()) cell.colour = static_cast<std::int8_t>(colour);
}

bool Canvas::is_free(int column, int row, int width) const {
  for (int c = column; c < column + width; ++c)
    if (!has(c, row) || !cells_[static_cast<size_t>(row) * columns_ + c].glyph.empty()) return false;
  return true;
}

void Canvas::line(double x0, double y0, double x1, double y1, Pen& pen, const Clip& clip) {
  if (!cut(x0, y0, x1, y1, clip)) return;
  // One dot per step of the longer side. The end points are rounded first: the line through two dots does
  // not depend on its direction, and the next segment begins on the dot where this one ended, which is
  // not counted twice.
  const long ax = std::lround(x0), ay = std::lround(y0), bx = std::lround(x1), by = std::lround(y1);
  const long steps = std::max(std::labs(bx - ax), std::labs(by - ay));
  for (long k = 0; k <= steps; ++k) {
    const double s = steps ? static_cast<double>(k) / static_cast<double>(steps) : 0;
    const int x = static_cast<int>(std::lround(static_cast<double>(ax) + s * static_cast<double>(bx - ax)));
    const int y = static_cast<int>(std::lround(static_cast<double>(ay) + s * static_cast<double>(by - ay)));
    if (pen.down() && x >= clip.left && x <= clip.right && y >= clip.top && y <= clip.bottom)
      dot(x, y, pen.colour);
    if (k < steps) ++pen.travelled;
  }
}

void Canvas::glyph(int column, int row, std::string_view character, int colour) {
  if (!has(column, row)) return;
  at(column, row).glyph = character;
  at(column, row).colour = static_cast<std::int8_t>(colour);
}

void Canvas::write(int column, int row, std::string_view utf8, int colour) {
  for (const std::string& c : characters(utf8)) glyph(column++, row, c, colour);
}

std::string Canvas::line_text(int row, Palette palette) const {
  const Cell* line = &cells_[static_cast<size_t>(row) * columns_];
  const auto blank = [](const Cell& c) { return c.glyph.empty() ? c.dots == 0 : c.glyph == " "; };
  int last = columns_ - 1;
  while (last >= 0 && blank(line[last])) --last;
  std::string out;
  int colour = ink;
  for (int column = 0; column <= last; ++column) {
    const Cell& cell = line[column];
    const bool empty = blank(cell);
    if (!empty && cell.colour != colour && palette != Palette::none) {
      if (colour != ink && cell.colour != ink) out += escape(ink, palette);
      out += escape(colour = cell.colour, palette);
    }
    out += empty ? " " : cell.glyph.empty() ? braille(cell.dots) : cell.glyph;
  }
  return colour == ink ? out : out + escape(ink, palette);
}

std::string Canvas::str(Palette palette) const {
  std::string out;
  int pending = 0;  // empty rows, written only if another row follows
  for (int row = 0; row < rows_; ++row) {
    const std::string line = line_text(row, palette);
    ++pending;
    if (line.empty()) continue;
    out.append(static_cast<size_t>(pending - 1), '\n');
    out += line + "\n";
    pending = 0;
  }
  return out;
}

std::string painted(const std::string& what, int colour, Palette palette) {
  if (colour == ink || palette == Palette::none || what.empty()) return what;
  return escape(colour, palette) + what + escape(ink, palette);
}

std::vector<std::string> characters(std::string_view utf8) {
  std::vector<std::string> out;
  for (size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i]);
    const size_t expected = lead < 0x80 ? 1 : lead >= 0xF0 && lead < 0xF5 ? 4 : lead >= 0xE0 ? 3 : 2;
    size_t end = i + 1;
    while (end < utf8.size() && end < i + expected && (static_cast<unsigned char>(utf8[end]) & 0xC0) == 0x80)
      ++end;
    const std::string_view c = utf8.substr(i, end - i);
    i = end;
    const bool broken = c.size() != expected || (lead >= 0x80 && lead < 0xC2) || lead >= 0xF5;
    if (broken || lead < 0x20 || lead == 0x7F)
      out.emplace_back(" ");
    else if (is_combining(c) && !out.empty())
      out.back() += c;
    else
      out.emplace_back(c);
  }
  return out;
}

std::string shortened(std::string_view utf8, int width) {
  const auto all = characters(utf8);
  std::string out;
  const bool fits = static_cast<int>(all.size()) <= width;
  const int keep = fits ? static_cast<int>(all.size()) : std::max(0, width - 1);
  for (int k = 0; k < keep; ++k) out += all[k];
  return fits || width < 1 ? out : out + "…";
}

}  // namespace pendula::plot
