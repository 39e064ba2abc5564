// A sheet of terminal cells. Each cell is a Unicode braille pattern of 2×4
// dots, or a character that covers it. Dots are nearly square, so a circle
// of dots looks like a circle. Coordinates: dots from the top left corner.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace pendula::plot {

/// The colours of the terminal.
enum class Palette { none, ansi8, ansi256 };

/// Colour of a cell: `ink` is the terminal's own foreground,
/// `faint` a quiet grey, 1, 2, … the series colours.
constexpr int ink = 0, faint = -1;

/// How a line is drawn: dots on and off in turn along its way, beginning with on. Empty: solid.
struct Pen {
  int colour = ink;
  std::vector<int> dashes;
  long travelled = 0;  ///< dots drawn so far, so that the pattern runs on through a polyline
  bool down() const;   ///< is the pen on the paper at `travelled`?
};

/// A rectangle of dots, inclusive: nothing is drawn outside.
struct Clip {
  int left, top, right, bottom;
};

class Canvas {
 public:
  Canvas(int columns, int rows);
  int columns() const { return columns_; }
  int rows() const { return rows_; }

  void dot(int x, int y, int colour);
  /// A straight line between two points in dot coordinates,
  /// cut at `clip`; advances the pen. Any finite coordinates.
  void line(double x0, double y0, double x1, double y1, Pen& pen, const Clip& clip);
  /// One character (with its combining marks) over a cell; outside the sheet it is dropped.
  void glyph(int column, int row, std::string_view character, int colour);
  /// A text from this cell to the right, cut at the edge of the sheet.
  void write(int column, int row, std::string_view utf8, int colour = ink);

  /// Are these cells on the sheet and without characters?
  bool is_free(int column, int row, int width) const;

  /// The sheet without empty rows at the end, one line per
  /// row without trailing blanks, each ended by a newline.
  std::string str(Palette palette) const;

 private:
  struct Cell {
    std::uint8_t dots = 0;
    std::int8_t colour = ink;
    std::string glyph;
  };
  bool has(int column, int row) const { return column >= 0 && column < columns_ && row >= 0 && row < rows_; }
  Cell& at(int column, int row) { return cells_[static_cast<size_t>(row) * columns_ + column]; }
  std::string line_text(int row, Palette palette) const;
  int columns_, rows_;
  std::vector<Cell> cells_;
};

/// Splits a text into characters, each with its combining
/// marks; control characters and broken UTF-8 become blanks.
std::vector<std::string> characters(std::string_view utf8);
inline int width_of(std::string_view utf8) { return static_cast<int>(characters(utf8).size()); }

/// The text in a colour of the palette, and back to normal after it.
std::string painted(const std::string& text, int colour, Palette palette);

/// At most `width` columns of the text, ended by "…" if something was cut.
std::string shortened(std::string_view utf8, int width);

}  // namespace pendula::plot
