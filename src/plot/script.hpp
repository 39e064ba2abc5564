// Pieces of a gnuplot script: quoting, data blocks, terminals,
// colours. Every text of the user goes through `quoted`.
#pragma once

#include <string>
#include <vector>

#include "plot/figure.hpp"

namespace pendula::plot {

/// Colour-blind-safe: Okabe & Ito (2008), without the yellow that vanishes on white.
std::string series_colour(size_t k);
/// Its own colour, or the palette's.
std::string colour_of(const Figure& figure, size_t k);

/// A single-quoted gnuplot text: nothing in it is expanded or executed.
std::string quoted(const std::string& utf8);

/// "#aarrggbb" from "#rrggbb" and an opacity between 0 and 1 (gnuplot counts transparency).
std::string translucent(const std::string& colour, double opacity);

/// Rows of numbers collected into a named inline data block.
class Block {
 public:
  explicit Block(std::string name) : name_(std::move(name)) {}
  const std::string& name() const { return name_; }
  void row(double x, double y);
  void row(double x, double low, double high);
  void gap();  ///< an empty line: the curve is interrupted, the polygon closed
  bool empty() const { return !any_; }
  bool is_open() const { return open_; }  ///< would the next row continue a curve?
  std::string str() const { return name_ + " << EOD\n" + rows_ + "EOD\n"; }

 private:
  std::string name_, rows_;
  bool any_ = false, open_ = false;
};

/// The user's, or one outside the frame where the legend fits and never hides data.
LegendPlace legend_place(const Figure& figure);

/// The preamble: terminal with its size, fonts, no interpretation of markup, title.
std::string preamble(const Figure& figure, const std::string& format);

/// The notes as small grey labels at the lower edge.
std::string note_labels(const Figure& figure);

/// Indices of the points worth writing: the drawable ones that move the picture by at least a fifth of a
/// pixel; -1 is a gap. A curve of 10⁶ points becomes a file of a reasonable size that looks the same.
std::vector<Eigen::Index> thinned(const Figure& figure, const Series& series);

/// Gives the script to gnuplot and its picture to the file (process.cpp); throws as save() does.
void run_gnuplot(const std::string& script, const std::string& path);

std::string flat_script(const Figure& figure);   ///< gnuplot.cpp: 2-D, after the preamble
std::string solid_script(const Figure& figure);  ///< gnuplot3.cpp: 3-D, projected by us

}  // namespace pendula::plot
