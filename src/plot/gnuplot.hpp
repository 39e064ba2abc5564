// Figures in files: SVG, PNG and PDF through a pipe to gnuplot.
#pragma once

#include <string>
#include <vector>

#include "plot/figure.hpp"

namespace pendula::plot {

/// Writes the figure to `path`; the extension (.svg .png .pdf) says the format. The file appears complete or
/// not at all; an existing file is replaced. The SVG of a figure is always the same text. Throws Error if
/// the extension is unknown, the folder missing or not writable, or gnuplot not installed;
///         Failure with gnuplot's words if it refuses; Interrupted on Ctrl-C
///         (gnuplot is ended, no file is left).
/// cost    about 0.1 s, most of it the start of gnuplot
void save(const Figure& figure, const std::string& path);

/// The SVG text of each figure, as save() would write it; one run of gnuplot for all
/// of them. throws, as save().
/// cost    0.1 s, and some 10 ms per figure
std::vector<std::string> svg_texts(const std::vector<Figure>& figures);

/// The script that save() gives to gnuplot, data included. `format` is "svg", "png" or "pdf".
std::string gnuplot_script(const Figure& figure, const std::string& format);

}  // namespace pendula::plot
