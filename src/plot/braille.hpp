// Figures in a terminal: text drawn with Unicode braille,
// about 5 ms, the same bytes for the same figure and width.
#pragma once

#include <string>

#include "plot/canvas.hpp"
#include "plot/figure.hpp"

namespace pendula::plot {

struct Terminal {
  int columns = 80, rows = 40;
  Palette palette = Palette::none;
};

/// Properties of the terminal behind a file descriptor: its size and colours if it is a terminal (no colours
/// when NO_COLOR is set or TERM is "dumb"), otherwise 80 columns without colours.
Terminal terminal_of(int descriptor);

/// The figure as text, every line ended by a newline, no
/// line wider than the terminal. Requires a checked figure.
std::string draw(const Figure& figure, const Terminal& terminal = {});

}  // namespace pendula::plot
