#include "plot/script.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.hpp"
#include "base/text.hpp"
#include "plot/canvas.hpp"
#include "plot/ticks.hpp"

namespace pendula::plot {

using Eigen::Index;

std::string series_colour(size_t k) {
  static const char* const colours[] = {"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                        "#E69F00", "#56B4E9", "#000000"};
  return colours[k % 7];
}

std::string colour_of(const Figure& figure, size_t k) {
  if (!figure.series[k].colour.empty()) return figure.series[k].colour;
  size_t number = 0;  // series with colours of their own do not consume colours of the palette
  for (size_t i = 0; i < k; ++i) number += figure.series[i].colour.empty();
  return series_colour(number);
}

/// A string expression of gnuplot: parts in single quotes, where gnuplot replaces nothing, joined with
/// runs of apostrophes in double quotes. (The documented '' inside single quotes fails for two
/// adjacent apostrophes: f''(x).)
std::string quoted(const std::string& utf8) {
  std::string out = "'";
  bool apostrophes = false;
  for (const std::string& c : characters(utf8)) {
    if ((c == "'") != apostrophes) out += apostrophes ? "\" . '" : "' . \"";
    apostrophes = c == "'";
    out += c;
  }
  return out + (apostrophes ? "\"" : "'");
}

std::string translucent(const std::string& colour, double opacity) {
  char alpha[8];
  std::snprintf(alpha, sizeof alpha, "#%02X", static_cast<int>(std::lround(255 * (1 - opacity))));
  return alpha + colour.substr(1);
}

void Block::row(double x, double y) {
  rows_ += shortest(x) + " " + shortest(y) + "\n";
  any_ = open_ = true;
}

void Block::row(double x, double low, double high) {
  rows_ += shortest(x) + " " + shortest(low) + " " + shortest(high) + "\n";
  any_ = open_ = true;
}

void Block::gap() {
  if (open_) rows_ += "\n";
  open_ = false;
}

LegendPlace legend_place(const Figure& figure) {
  if (!has_legend(figure)) return LegendPlace::none;
  if (figure.legend_at != LegendPlace::automatic) return figure.legend_at;
  size_t length = 0, longest = 0;  // in characters; 80 characters are as wide as the frame
  for (const Series& s : figure.series) {
    const size_t own = characters(s.label).size();
    length += 6 + own;
    longest = std::max(longest, own);
  }
  constexpr size_t frame = 80, beside = 25;  // characters; a legend of 25 takes a third of the page
  if (length <= frame) return LegendPlace::above;
  return longest <= beside ? LegendPlace::right : LegendPlace::below;
}

std::string preamble(const Figure& figure, const std::string& format) {
  const int width = figure.size[0] ? figure.size[0] : figure.three_d ? 700 : 800;
  const int height = figure.size[1] ? figure.size[1] : figure.three_d ? 640 : 500;
  std::string out = "set encoding utf8\n";
  if (format == "svg")
    out += text("set terminal svg size ", width, ",", height,
                " fixed rounded noenhanced font 'DejaVu Sans,Arial,sans-serif,14' background '#FFFFFF'\n");
  else if (format == "png")  // double size, to be sharp on high-resolution screens and in print
    out += text("set terminal pngcairo size ", 2 * width, ",", 2 * height,
                " rounded noenhanced font 'DejaVu Sans,11' fontscale 2 linewidth 2 "
                "pointscale 2 background '#FFFFFF'\n");
  else
    out += text("set terminal pdfcairo size ", width / 96.0, "in,", height / 96.0,
                "in rounded noenhanced font 'DejaVu Sans,11' background '#FFFFFF'\n");
  if (!figure.title.empty()) {
    // Moves the title up to leave room for a legend between title and frame.
    const bool legend = !figure.three_d && legend_place(figure) == LegendPlace::above;
    out += "set title " + quoted(figure.title) + (legend ? " offset 0,1.6" : "") +
           " font ',16' noenhanced textcolor rgb '#333333'\n";
  }
  return out;
}

std::string note_labels(const Figure& figure) {
  std::string out;
  const double height = figure.size[1] ? figure.size[1] : figure.three_d ? 640 : 500;
  for (size_t k = 0; k < figure.notes.size(); ++k)
    out += text("set label ", 1000 + k, " ", quoted(figure.notes[k]), " at screen 0.015,",
                rounded((12 + 16.0 * static_cast<double>(figure.notes.size() - 1 - k)) / height, 6),
                " font ',10' textcolor rgb '#666666' noenhanced\n");
  return out;
}

std::vector<Index> thinned(const Figure& f, const Series& s) {
  std::vector<Index> kept;
  const Index n = s.x.size();
  constexpr Index few = 3000;  // points that make a file of 100 KB at most
  if (!f.three_d &&
      (s.style == Style::cells || s.style == Style::steps || s.style == Style::impulses || n < few)) {
    for (Index i = 0; i < n; ++i) {
      if (s.starts_at(i)) kept.push_back(-1);
      kept.push_back(drawable(f, s, i) ? i : -1);
    }
    return kept;
  }
  constexpr double resolution = 1.0 / 4000;  // of the width and height of the frame: a fifth of a pixel
  const int axes = f.three_d ? 3 : 2;
  Range range[3];
  for (int a = 0; a < axes; ++a) range[a] = visible(f, a);
  const auto place = [&](Index i, int a) {
    return fraction(f.axes[a], range[a], a == 0 ? s.x[i] : a == 1 ? s.y[i] : s.z[i]);
  };
  double last[3] = {0, 0, 0};
  Index skipped = -1;
  for (Index i = 0; i < n; ++i) {
    if (!drawable(f, s, i) || s.starts_at(i)) {
      if (skipped >= 0) kept.push_back(skipped);
      kept.push_back(-1);
      skipped = -1;
    }
    if (!drawable(f, s, i)) continue;
    double moved = 0;
    for (int a = 0; a < axes; ++a) moved = std::max(moved, std::abs(place(i, a) - last[a]));
    if (!kept.empty() && kept.back() >= 0 && moved < resolution && i + 1 < n) {
      skipped = i;
      continue;
    }
    for (int a = 0; a < axes; ++a) last[a] = place(i, a);
    kept.push_back(i);
    skipped = -1;
  }
  return kept;
}

}  // namespace pendula::plot
