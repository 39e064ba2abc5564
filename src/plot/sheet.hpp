// Shared by 2-D and 3-D drawings in a terminal: pens and marks that distinguish series, the lines above the
// picture (title, legend) and below it (notes).
#pragma once

#include <string>
#include <vector>

#include "plot/braille.hpp"

namespace pendula::plot {

/// What distinguishes series k: colour on a colour terminal, dashes and marks elsewhere.
struct Look {
  Pen pen;
  std::string mark;     ///< the character for its points
  bool marked = false;  ///< also set a mark now and then along the line, since the dashes are used up
};

Look look(const Figure& figure, size_t series, Palette palette);

bool draws_line(Style style);
bool draws_points(Style style);

/// The legend set in lines of at most `columns` columns. Empty when there is none.
class Legend {
 public:
  Legend(const Figure& figure, const Terminal& terminal, int columns);
  int rows() const { return static_cast<int>(lines_.size()); }
  int width() const;  ///< of the widest line
  /// Draws its first line at (column, row) and the others below.
  void draw(Canvas& canvas, int column, int row) const;

 private:
  struct Entry {
    size_t series;
    std::string label;
    int width;
  };
  const Figure& figure_;
  Palette palette_;
  std::vector<std::vector<Entry>> lines_;
};

/// The notes, broken at blanks into lines of at most `columns` columns.
std::vector<std::string> note_lines(const Figure& figure, int columns);

/// The notes as they stand below a picture: quiet, a line each.
std::string note_text(const Figure& figure, const Terminal& terminal);

constexpr int mark_gap = 12;  ///< columns between the marks of a line: six in a frame of 72 columns
/// Sets marks along a way, but not closer than `gap` columns (or 2 rows) to the one before.
class Marker {
 public:
  Marker(Canvas& canvas, const Look& look, int gap) : canvas_(canvas), look_(look), gap_(gap) {}
  void operator()(double x, double y, const Clip& clip);  ///< dot coordinates

 private:
  Canvas& canvas_;
  const Look& look_;
  int gap_;
  int column_ = -1000, row_ = -1000;  // of the last mark: none near the sheet
};

std::string draw_flat(const Figure& figure, const Terminal& terminal);   ///< braille.cpp
std::string draw_solid(const Figure& figure, const Terminal& terminal);  ///< braille3.cpp

}  // namespace pendula::plot
