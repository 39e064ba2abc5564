// A sequence of figures in time: played in a terminal, or written as an animated GIF.
#pragma once

#include <string>
#include <vector>

#include "plot/braille.hpp"
#include "plot/figure.hpp"

namespace pendula::plot {

/// Draws the figures one after the other in the same place, `pause` seconds apart. On no terminal only the
/// last one is drawn. spelled: what the terminal can show of a drawing. throws Interrupted on Ctrl-C.
void play(const std::vector<Figure>& figures, double pause, std::string (*spelled)(const std::string&));

/// Writes the figures as an animated GIF that repeats, `pause` seconds apart (whole
/// hundredths). throws as save().
/// cost    some 20 ms per figure
void save_film(const std::vector<Figure>& figures, double pause, const std::string& path);

}  // namespace pendula::plot
