// 2-D figures as gnuplot scripts, and the saving of both kinds.
#include "plot/gnuplot.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "plot/script.hpp"
#include "plot/ticks.hpp"

namespace pendula::plot {
namespace {

using Eigen::Index;

const char* const axis_names[] = {"x", "y"};

std::string axis_lines(const Figure& f, int a) {
  const Axis& axis = f.axes[static_cast<size_t>(a)];
  const Range r = visible(f, a);
  const Ticks t = ticks(axis, r, a == 0 ? 9 : 7);
  const std::string name = axis_names[a];
  std::string out = "set " + name + "range [" + shortest(axis.reversed ? r.high : r.low) + ":" +
                    shortest(axis.reversed ? r.low : r.high) + "]\n";
  if (axis.log) out += "set logscale " + name + " 10\n";
  out += "set " + name + "tics nomirror (";
  for (size_t k = 0; k < t.at.size(); ++k)
    out += (k ? ", " : "") + quoted(t.text[k]) + " " + shortest(t.at[k]);
  for (double m : t.minor)
    if (std::find(t.at.begin(), t.at.end(), m) == t.at.end()) out += ", '' " + shortest(m) + " 1";
  out += ")\n";
  const std::string label = labelled(axis_label(f, a), t);
  if (!label.empty()) out += "set " + name + "label " + quoted(label) + " noenhanced\n";
  return out;
}

/// Where the legend never hides data: above the frame while it fits there, then to the right, long labels
/// below.
std::string key_lines(const Figure& f) {
  const std::string common = " Left reverse noenhanced samplen 2.5 spacing 1.15 textcolor '#333333'\n";
  switch (legend_place(f)) {
    case LegendPlace::none:
      return "unset key\nset rmargin 3\n";
    case LegendPlace::right:
      return "set key outside right top vertical" + common;
    case LegendPlace::below:
      return "set rmargin 3\nset key below vertical maxcols 1" + common;
    case LegendPlace::above:
      break;
  }
  if (f.title.empty()) return "set rmargin 3\nset key above right horizontal" + common;
  // Between the title and the frame; gnuplot's own place would be above the title.
  return "set rmargin 3\nset tmargin 4.8\nset key at graph 1, graph 1.02 right bottom horizontal" + common;
}

/// "with …" for one series; colour and dashes tell series apart.
std::string with_style(const Series& s, size_t k) {
  static const char* const dashes[] = {"", " dashtype 2", " dashtype 3", " dashtype 4"};
  static const int marks[] = {7, 9, 5, 13, 6, 8, 4, 12};
  const std::string colour = " linecolor rgb '" + series_colour(k) + "'";
  const std::string mark = text(" pointtype ", marks[k % 8], " pointsize 0.6");
  const std::string dash = dashes[k / 7 % 4];
  switch (s.style) {
    case Style::line:
      return "with lines linewidth 1.8" + colour + dash;
    case Style::steps:
      return "with steps linewidth 1.8" + colour + dash;
    case Style::points:
      return "with points" + mark + colour;
    case Style::line_points:
      return "with linespoints linewidth 1.5" + mark + colour + dash;
    case Style::dots:
      return "with points pointtype 7 pointsize 0.15" + colour;
    case Style::impulses:
      return "with impulses linewidth 1.5" + colour;
    case Style::cells:
      return "with boxxyerror fillstyle solid 0.9 noborder" + colour;
  }
  return "";
}

std::string extension_of(const std::string& path) {
  const size_t slash = path.rfind('/'), dot = path.rfind('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash) || dot + 1 == path.size())
    return "";
  std::string ending = path.substr(dot + 1);
  for (char& c : ending) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return ending;
}

}  // namespace

std::string flat_script(const Figure& f) {
  std::string out =
      "set border 3 linewidth 1 linecolor rgb '#666666'\n"
      "set grid xtics ytics linetype 1 linewidth 0.6 linecolor rgb '#DDDDDD'\n"
      "set tics out scale 0.6 textcolor rgb '#333333'\n";
  out += axis_lines(f, 0) + axis_lines(f, 1) + key_lines(f) + note_labels(f);
  if (!f.notes.empty() && legend_place(f) != LegendPlace::below)
    out += text("set bmargin ",
                (axis_label(f, 0).empty() ? 2.5 : 4.0) + 1.1 * static_cast<double>(f.notes.size()), "\n");
  if (f.equal) out += "set size ratio -1\n";
  std::string plots;
  for (size_t k = 0; k < f.series.size(); ++k) {
    const Series& s = f.series[k];
    Block block(text("$data", k + 1));
    for (Index i : thinned(f, s)) {
      if (i < 0)
        block.gap();
      else
        block.row(s.x[i], s.y[i]);
    }
    if (block.empty()) continue;
    out += block.str();
    const std::string columns = s.style == Style::cells ? text(" using 1:2:(", shortest(s.cell[0] / 2), "):(",
                                                               shortest(s.cell[1] / 2), ") ")
                                                        : " using 1:2 ";
    const std::string title = s.label.empty() ? " notitle" : " title " + quoted(s.label);
    plots += (plots.empty() ? "plot " : ", \\\n     ") + block.name() + columns + with_style(s, k) + title;
    if (s.style == Style::impulses) {
      Series marks;
      marks.style = Style::points;
      plots += ", \\\n     " + block.name() + columns + with_style(marks, k) + " notitle";
    }
  }
  return out + plots + "\n";
}

/// Panels one under the other; what one of them sets, the next one takes back.
static std::string panels_script(const Figure& figure, const std::string& format) {
  Figure page = figure;
  page.size = {figure.size[0] ? figure.size[0] : 800,
               figure.size[1] ? figure.size[1] : 360 * static_cast<int>(figure.below.size() + 1)};
  std::string out = preamble(page, format) + text("set multiplot layout ", figure.below.size() + 1, ",1\n") +
                    "set lmargin 10\n" + flat_script(figure);
  for (const Figure& panel : figure.below) {
    out += "unset logscale\nunset label\nunset title\nset tmargin\nset bmargin\nset rmargin\n";
    if (!panel.title.empty()) out += "set title " + quoted(panel.title) + " font ',16' noenhanced\n";
    out += flat_script(panel);
  }
  return out + "unset multiplot\n";
}

std::string gnuplot_script(const Figure& figure, const std::string& format) {
  if (!figure.below.empty()) return panels_script(figure, format);
  return preamble(figure, format) + (figure.three_d ? solid_script(figure) : flat_script(figure));
}

void save(const Figure& figure, const std::string& path) {
  static const std::vector<std::string> known{"svg", "png", "pdf"};
  const std::string ending = extension_of(path);
  if (std::find(known.begin(), known.end(), ending) == known.end())
    throw Error("cannot save '" + path + "': " +
                (ending.empty() ? "the file name has no extension" : "unknown extension '." + ending + "'") +
                "; the extension says the format: .svg, .png or .pdf");
  run_gnuplot(gnuplot_script(figure, ending), path);
}

}  // namespace pendula::plot
