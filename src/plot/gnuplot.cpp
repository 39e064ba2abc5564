// 2-D figures as gnuplot scripts, and the saving of 2-D and 3-D figures.
#include "plot/gnuplot.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "plot/canvas.hpp"
#include "plot/script.hpp"
#include "plot/ticks.hpp"

namespace pendula::plot {
namespace {

using Eigen::Index;

const char* const gnuplot_axes[] = {"x", "y"};

/// Maximum number of tick labels on the x axis: some 55 pixels per number; margins left and right of the
/// frame take 140.
int room_for_numbers(const Figure& f) {
  const double width = (f.size[0] > 0 ? f.size[0] : 800) - 140,
               height = (f.size[1] > 0 ? f.size[1] : 500) - 110;
  const double frame =
      f.equal ? std::min(width, height * visible(f, 0).span() / visible(f, 1).span()) : width;
  return std::clamp(static_cast<int>(frame / 55), 3, 9);
}

/// Maximum number of tick labels on a y axis: 40 pixels per line; margins above and below the frame take 80.
int room_for_lines(const Figure& f) {
  const int height = f.size[1] > 0 ? f.size[1] : 500;
  return std::clamp((height - 80) / 40, 3, 7);
}

std::string axis_lines(const Figure& f, int a) {
  const Axis& axis = f.axes[a];
  const Range r = visible(f, a);
  const Ticks t = ticks(axis, r, a == 0 ? room_for_numbers(f) : room_for_lines(f));
  const std::string name = gnuplot_axes[a];
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
  if (!label.empty())
    out += "set " + name + "label " + quoted(label) + " noenhanced textcolor rgb '#333333'\n";
  return out;
}

/// Places the legend where it does not hide data: above the frame if it fits there, else to the right, and
/// below the frame if labels are long.
std::string key_lines(const Figure& f) {
  const std::string common = " Left reverse noenhanced samplen 2.5 spacing 1.15 textcolor rgb '#333333'\n";
  switch (legend_place(f)) {
    case LegendPlace::none:
      return "unset key\nset rmargin 3\n";
    case LegendPlace::right:
      return "set key outside right top vertical" + common;
    case LegendPlace::below:
      return "set rmargin 3\nset key below vertical maxcols 1" + common;
    case LegendPlace::top_left:
      return "set rmargin 3\nset key inside left top vertical opaque" + common;
    case LegendPlace::top_right:
      return "set rmargin 3\nset key inside right top vertical opaque" + common;
    case LegendPlace::bottom_left:
      return "set rmargin 3\nset key inside left bottom vertical opaque" + common;
    case LegendPlace::bottom_right:
      return "set rmargin 3\nset key inside right bottom vertical opaque" + common;
    case LegendPlace::above:
    case LegendPlace::automatic:
      break;
  }
  if (f.title.empty()) return "set rmargin 3\nset key above right horizontal" + common;
  // between the title and the frame; gnuplot's default position is above the title
  return "set rmargin 3\nset tmargin 4.8\nset key at graph 1, graph 1.02 right bottom horizontal" + common;
}

std::string dash_of(const Series& s, size_t k) {
  static const char* const dashes[] = {"", " dashtype 2", " dashtype 3", " dashtype 4"};
  static const char* const named[] = {"", "", " dashtype (9,6)", " dashtype (2,4)", " dashtype (9,5,2,5)"};
  return s.dash == Dash::automatic ? dashes[k / 7 % 4] : named[static_cast<int>(s.dash)];
}

std::string mark_of(const Series& s, size_t k) {
  static const int marks[] = {7, 9, 5, 13, 6, 8, 4, 12};
  static const int named[] = {0, 7, 6, 5, 4, 9, 13, 1, 2};  // in the order of Mark
  if (s.mark == Mark::automatic) return text(" pointtype ", marks[k % 8], " pointsize 0.6");
  return text(" pointtype ", named[static_cast<int>(s.mark)], " pointsize 1.1 linewidth 1.8");
}

/// A diameter large enough for few dots to be visible and small enough for many not to overlap.
std::string dot_size(const Series& s) {
  return rounded(std::clamp(4 / std::sqrt(static_cast<double>(s.x.size()) + 1), 0.15, 0.4), 2);
}

/// The "with …" part for one series, with its colour and dash pattern.
std::string with_style(const Figure& f, size_t k, Style style) {
  const Series& s = f.series[k];
  const std::string colour = " linecolor rgb '" + colour_of(f, k) + "'";
  const auto lines = [&](const char* usual) {
    return " linewidth " + (s.width > 0 ? shortest(s.width) : std::string(usual)) + colour + dash_of(s, k);
  };
  switch (style) {
    case Style::line:
      return "with lines" + lines("1.8");
    case Style::steps:
      return "with steps" + lines("1.8");
    case Style::points:
      return "with points" + mark_of(s, k) + colour;
    case Style::line_points:
      return "with linespoints" + mark_of(s, k) + lines("1.5");
    case Style::dots:
      return "with points pointtype 7 pointsize " + dot_size(s) + colour;
    case Style::impulses:
      return "with impulses linewidth " + (s.width > 0 ? shortest(s.width) : std::string("1.5")) + colour;
    case Style::cells:
      if (s.value.size()) return "with boxxyerror fillstyle solid 1 noborder linecolor palette";
      return "with boxxyerror fillstyle solid 0.9 noborder" + colour;
    case Style::fill:
      return "with filledcurves fillstyle transparent solid 0.35 noborder" + colour;
  }
  return "";
}

/// The columns of the data block from which a series is drawn.
std::string columns_of(const Series& s) {
  if (s.style == Style::cells && s.value.size())
    // cells overlap by 4 %, otherwise seams between them are visible
    return text(" using 1:2:(", shortest(0.52 * s.cell[0]), "):(", shortest(0.52 * s.cell[1]), "):3 ");
  if (s.style == Style::cells)
    return text(" using 1:2:(", shortest(s.cell[0] / 2), "):(", shortest(s.cell[1] / 2), ") ");
  return s.style == Style::fill ? " using 1:2:3 " : " using 1:2 ";
}

Block data_of(const Figure& f, const Series& s, const std::string& name) {
  Block block(name);
  for (Index i : thinned(f, s)) {
    if (i < 0)
      block.gap();
    else if (s.value.size() && std::isfinite(s.value[i]))
      block.row(s.x[i], s.y[i], s.value[i]);
    else if (s.value.size())
      continue;  // not finite: the cell is left empty
    else if (s.style == Style::fill)
      block.row(s.x[i], s.lower.size() ? s.lower[i] : 0, s.y[i]);
    else
      block.row(s.x[i], s.y[i]);
  }
  return block;
}

/// The points with marks, if only some of the points have one.
Block marks_of(const Figure& f, const Series& s, const std::string& name) {
  Block block(name);
  for (Index i : s.marked)
    if (drawable(f, s, i)) block.row(s.x[i], s.y[i]);
  return block;
}

/// Lines across the frame and texts in it.
std::string rule_lines(const Figure& f) {
  std::string out;
  size_t number = 1;
  for (const Rule& rule : f.rules) {
    const std::string at = shortest(rule.at);
    const bool flat = rule.axis == 1;
    out += text("set arrow ", number,
                flat ? " from graph 0, first " + at + " to graph 1, first " + at
                     : " from first " + at + ", graph 0 to first " + at + ", graph 1",
                " nohead front linewidth 1.2 dashtype (6,4) linecolor rgb '#555555'\n");
    if (!rule.label.empty())
      out += text("set label ", number, " ", quoted(rule.label),
                  flat ? " at graph 0.99, first " + at + " right offset 0,0.5"
                       : " at first " + at + ", graph 0.97 left offset 0.6,0",
                  " front noenhanced textcolor rgb '#555555'\n");
    ++number;
  }
  for (const Words& words : f.texts)
    out += text("set label ", number++, " ", quoted(words.text), " at first ", shortest(words.x), ", first ",
                shortest(words.y), " front noenhanced textcolor rgb '#333333'\n");
  return out;
}

/// The settings of the second y axis.
std::string right_axis_lines(const Figure& f) {
  if (!f.right) return "unset y2tics\nunset y2label\n";
  const Range r = *f.right->limits;
  const Ticks t = ticks(*f.right, r, room_for_lines(f));
  std::string out =
      text("set border 11\nset y2range [", shortest(r.low), ":", shortest(r.high), "]\nset y2tics (");
  for (size_t k = 0; k < t.at.size(); ++k)
    out += (k ? ", " : "") + quoted(t.text[k]) + " " + shortest(t.at[k]);
  return out + ")\nset rmargin 10\nset y2label " + quoted(labelled(f.right->label, t)) +
         " noenhanced textcolor rgb '#333333'\n";
}

/// Viridis (van der Walt and Smith, 2015): equal steps of lightness, safe for colour-blind readers.
std::string palette_lines(const Figure& f) {
  const auto range = value_range(f);
  if (!range) return "";
  return text("set palette defined (0 '#440154', 1 '#3B528B', 2 '#21918C', 3 '#5EC962', 4 '#FDE725')\n",
              "set cbrange [", shortest(range->low), ":", shortest(range->high),
              "]\nset colorbox\nset rmargin 12\nset cbtics textcolor rgb '#333333'\n",
              f.value_label.empty()
                  ? "unset cblabel\n"
                  : "set cblabel " + quoted(f.value_label) + " noenhanced textcolor rgb '#333333'\n");
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
      "set tics out scale 0.6 textcolor rgb '#333333'\n";
  out += f.grid ? "set grid xtics ytics linetype 1 linewidth 0.6 linecolor rgb '#DDDDDD'\n" : "unset grid\n";
  out += axis_lines(f, 0) + axis_lines(f, 1) + key_lines(f) + note_labels(f);
  if (!f.notes.empty() && legend_place(f) != LegendPlace::below)
    out += text("set bmargin ",
                (axis_label(f, 0).empty() ? 2.5 : 4.0) + 1.1 * static_cast<double>(f.notes.size()), "\n");
  out += right_axis_lines(f) + palette_lines(f);
  if (f.equal) out += "set size ratio -1\n";
  out += rule_lines(f);
  std::string plots;
  const auto add = [&](const Block& block, const std::string& how) {
    if (block.empty()) return false;
    out += block.str();
    plots += (plots.empty() ? "plot " : ", \\\n     ") + block.name() + how;
    return true;
  };
  for (size_t k = 0; k < f.series.size(); ++k) {
    const Series& s = f.series[k];
    const bool some_marks = s.style == Style::line_points && !s.marked.empty();
    const std::string title = s.label.empty() ? " notitle" : " title " + quoted(s.label);
    const Style style = some_marks ? Style::line : s.style;
    if (!add(data_of(f, s, text("$data", k + 1)), columns_of(s) + with_style(f, k, style) + title)) continue;
    if (some_marks)
      add(marks_of(f, s, text("$marks", k + 1)),
          " using 1:2 " + with_style(f, k, Style::points) + " notitle");
    if (s.style == Style::impulses)
      plots += text(", \\\n     $data", k + 1, " using 1:2 ", with_style(f, k, Style::points), " notitle");
  }
  return out + plots + "\n";
}

/// Panels row by row. gnuplot keeps settings from one panel to the next, therefore each panel
/// first resets them.
static std::string panels_script(const Figure& figure, const std::string& format) {
  const int count = static_cast<int>(figure.below.size()) + 1, columns = std::max(1, figure.columns);
  const int rows = (count + columns - 1) / columns;
  Figure page = figure;
  page.size = {figure.size[0] ? figure.size[0]
               : columns == 1 ? 800
                              : 560 * columns,
               figure.size[1] ? figure.size[1] : (columns == 1 ? 360 : 420) * rows};
  page.title.clear();
  std::string out =
      preamble(page, format) + text("set multiplot layout ", rows, ",", columns, "\n") + "set lmargin 10\n";
  const auto add = [&](Figure panel) {
    panel.size = {page.size[0] / columns, page.size[1] / rows};
    out +=
        "unset logscale\nunset label\nunset arrow\nunset title\nunset xlabel\nunset ylabel\nset tmargin\n"
        "set bmargin\nset rmargin\nset size noratio\n";
    if (!panel.title.empty()) {
      const bool legend = legend_place(panel) == LegendPlace::above;
      out += "set title " + quoted(panel.title) + (legend ? " offset 0,1.6" : "") +
             " font ',16' noenhanced textcolor rgb '#333333'\n";
    }
    out += flat_script(panel);
  };
  add(figure);
  for (const Figure& panel : figure.below) add(panel);
  return out + "unset multiplot\n";
}

/// Replaces the colours of a light page by those of a dark one; curves keep their colours except
/// black and blue.
static std::string darkened(std::string script) {
  static const std::pair<const char*, const char*> colours[] = {
      {"#FFFFFF", "#14171A"}, {"#333333", "#E6E6E6"}, {"#666666", "#A0A4A8"},
      {"#555555", "#B4B8BC"}, {"#DDDDDD", "#33383D"}, {"#F7F7F7", "#1E2327"},
      {"#D0D0D0", "#3A4046"}, {"#000000", "#F2F2F2"}, {"#0072B2", "#4DA3D9"}};
  std::string out;
  for (size_t at = 0; at < script.size();) {
    const auto* found = std::find_if(std::begin(colours), std::end(colours), [&](const auto& pair) {
      return script.compare(at, 7, pair.first) == 0;
    });
    if (found == std::end(colours)) {
      out += script[at++];
    } else {
      out += found->second;
      at += 7;
    }
  }
  return out;
}

/// For a figure with equal axes and no given size: a sheet that fits the frame with the legend to its right.
/// In pixels: frames like those of 800×500, beside 140×110 for numbers and labels; letters are 8.5 wide
/// in a legend and 9 in a title.
static Figure fitted(Figure f) {
  if (!f.equal || f.three_d || f.size[0] || f.size[1]) return f;
  const double ratio = visible(f, 0).span() / visible(f, 1).span();
  const double width = std::min(660.0, 390 * ratio), height = std::max(width / ratio, 120.0);
  std::size_t longest = 0;
  for (const Series& s : f.series) longest = std::max(longest, characters(s.label).size());
  const double legend = legend_place(f) == LegendPlace::right ? 70 + 8.5 * static_cast<double>(longest) : 0;
  const double title = 200 + 9.0 * static_cast<double>(characters(f.title).size());
  f.size = {static_cast<int>(std::max({width + legend + 140, title, 400.0})), static_cast<int>(height + 110)};
  return f;
}

std::string gnuplot_script(const Figure& given, const std::string& format) {
  const Figure figure = given.below.empty() ? fitted(given) : given;
  const std::string script =
      !figure.below.empty()
          ? panels_script(figure, format)
          : preamble(figure, format) + (figure.three_d ? solid_script(figure) : flat_script(figure));
  return figure.dark ? darkened(script) : script;
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
