// The `plot` module: figures from tables of columns. The functions for users (plot, plot3, semilogy, …) are
// in stdlib/plot.lua; all of them call figure{…}.
#include <array>
#include <cstdio>

#include <unistd.h>

#include "lua/bind/plot/figure_reader.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"
#include "lua/screen/pager.hpp"
#include "plot/braille.hpp"
#include "plot/figure.hpp"
#include "plot/film.hpp"
#include "plot/gnuplot.hpp"

namespace pendula::lua {

namespace {

using Eigen::Index;

/// The function of stdlib/plot.lua that the user called; errors carry its name instead of figure.
std::string called_as(lua_State* L) {
  if (!lua_istable(L, 1)) return "";
  lua_pushliteral(L, "by");
  const std::string name = lua_rawget(L, 1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
  lua_pop(L, 1);
  return name;
}

int figure(Call& call) {
  try {
    return call.push(std::make_shared<const plot::Figure>(read_figure(call)));
  } catch (const LuaError&) {
    throw;
  } catch (const UserFacing& e) {
    const std::string name = called_as(call.L);
    if (name.empty()) throw;
    throw LuaError(user_position(call.L) + name + ": " + e.what());
  }
}

int sphere(Call& call) {
  std::array<double, 3> center{0, 0, 0};
  if (call.has(2)) {
    const Vec c = to_numbers(call.L, 2, "center");
    if (c.size() != 3) throw Error(text("the center must have three coordinates, got ", c.size()));
    for (Index i = 0; i < 3; ++i) center[i] = c[i];
  }
  if (!call.has(1)) call.wrong(1, "radius", "a number");
  return call.push(std::make_shared<const plot::Surface>(
      plot::sphere(number_with_defaults(call.L, 1, "the radius"), center)));
}

std::array<double, 2> interval(Call& call, int i, const char* name) {
  const Vec ends = to_numbers(call.L, i, name);
  if (ends.size() != 2)
    throw Error(text("bad argument #", i, " '", name, "': expected two numbers { from, to }"));
  return {ends[0], ends[1]};
}

/// Calls f(u, v) at the node (i, j): z = f(x, y), or three numbers x, y, z, or a list of three.
void call_node(Call& call, plot::Surface& s, Index i, Index j, double u, double v) {
  lua_State* L = call.L;
  const int top = lua_gettop(L);
  lua_pushvalue(L, 1);
  lua_pushnumber(L, u);
  lua_pushnumber(L, v);
  protected_call(L, 2, LUA_MULTRET);
  const int results = lua_gettop(L) - top;
  const bool list = results == 1 && lua_type(L, -1) != LUA_TNUMBER;
  if (results == 1 && !list) {
    s.x(i, j) = u;
    s.y(i, j) = v;
    s.z(i, j) = lua_tonumber(L, -1);
  } else if (list) {
    const Vec p = to_numbers(L, top + 1, "the result of f");
    if (p.size() != 3)
      throw Error(text("f must return z or x, y, z, but it returned ", p.size(), " numbers"));
    s.x(i, j) = p[0];
    s.y(i, j) = p[1];
    s.z(i, j) = p[2];
  } else {
    if (results != 3) throw Error(text("f must return z or x, y, z, but it returned ", results, " values"));
    s.x(i, j) = to_number(L, top + 1, "x");
    s.y(i, j) = to_number(L, top + 2, "y");
    s.z(i, j) = to_number(L, top + 3, "z");
  }
  lua_settop(L, top);
}

plot::Surface surface_of_function(Call& call) {
  const auto us = interval(call, 2, "u"), vs = interval(call, 3, "v");
  const long n = call.integer(4, "n", 24);
  if (n < 1 || n > 500)
    throw Error(text("bad argument #4 'n': expected between 1 and 500 pieces per side, got ", n));
  plot::Surface s;
  s.x = s.y = s.z = Mat::Zero(n + 1, n + 1);
  for (long i = 0; i <= n; ++i)
    for (long j = 0; j <= n; ++j) {
      const double r = static_cast<double>(i) / static_cast<double>(n),
                   q = static_cast<double>(j) / static_cast<double>(n);
      call_node(call, s, i, j, us[0] + r * (us[1] - us[0]), vs[0] + q * (vs[1] - vs[0]));
    }
  return s;
}

int surface(Call& call) {
  plot::Surface s;
  if (lua_isfunction(call.L, 1))
    s = surface_of_function(call);
  else
    s = {to_numeric_matrix(call.L, 1, "x"), to_numeric_matrix(call.L, 2, "y"),
         to_numeric_matrix(call.L, 3, "z")};
  plot::Figure probe;
  probe.three_d = true;
  probe.surfaces = {s};
  plot::checked(probe);
  return call.push(std::make_shared<const plot::Surface>(std::move(s)));
}

template <Mat plot::Surface::*Grid>
int grid(Call& call) {
  return push_matrix(call.L, call.object<plot::Surface>(1, "surface").*Grid);
}

int surface_text(Call& call) {
  const auto& s = call.object<plot::Surface>(1, "surface");
  return call.push(text("surface: ", s.x.rows(), "×", s.x.cols(), " nodes"));
}

// ── methods of a figure ──

const plot::Figure& figure_of(Call& call) { return call.object<plot::Figure>(1, "figure"); }

int show(Call& call) {
  const std::string drawing = showable(plot::draw(figure_of(call), plot::terminal_of(STDOUT_FILENO)));
  std::fwrite(drawing.data(), 1, drawing.size(), stdout);
  std::fflush(stdout);
  return 0;
}

int drawing_text(Call& call) {
  plot::Terminal terminal;
  const long columns = call.integer(2, "columns", 80);
  if (columns < 30 || columns > 120) throw Error(text("columns must lie between 30 and 120, got ", columns));
  terminal.columns = static_cast<int>(columns);
  return call.push(plot::draw(figure_of(call), terminal));
}

int save(Call& call) {
  const auto& figure = figure_of(call);  // before the file, so that the first wrong argument is reported
  plot::save(figure, call.string(2, "file"));
  lua_settop(call.L, 1);
  return 1;
}

int push_texts(lua_State* L, const std::vector<std::string>& texts) {
  lua_createtable(L, static_cast<int>(texts.size()), 0);
  for (size_t i = 0; i < texts.size(); ++i) {
    lua_pushlstring(L, texts[i].data(), texts[i].size());
    lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
  }
  return 1;
}

/// Appends the figures of the list at an argument.
void read_figures(Call& call, int argument, std::vector<plot::Figure>& into) {
  call.table(argument, "figures");
  const lua_Integer n = list_size(call.L, argument, "figures");
  for (lua_Integer i = 1; i <= n; ++i) {
    lua_rawgeti(call.L, argument, i);
    const auto* held = object_at(call.L, lua_gettop(call.L), TypeName<plot::Figure>::value);
    if (!held || !*held) throw Error(text("figure ", i, " is not a figure"));
    into.push_back(*static_cast<const plot::Figure*>(held->get()));
    lua_pop(call.L, 1);
  }
}

/// fig:svg() -> text; fig:svg{ others } -> list of texts.
int svg(Call& call) {
  std::vector<plot::Figure> figures{figure_of(call)};
  if (!call.has(2)) return call.push(plot::svg_texts(figures)[0]);
  read_figures(call, 2, figures);
  return push_texts(call.L, plot::svg_texts(figures));
}

/// The figures of an animation: this one and those of the list at argument 2.
std::vector<plot::Figure> film(Call& call) {
  std::vector<plot::Figure> figures{figure_of(call)};
  read_figures(call, 2, figures);
  return figures;
}

double pause_of(Call& call, int argument) {
  const double pause = call.number(argument, "pause", 0.04);
  if (!(pause >= 0.01 && pause <= 60))
    throw Error("the pause between figures must lie between 0.01 and 60 s");
  return pause;
}

int play(Call& call) {
  plot::play(film(call), pause_of(call, 3), showable);
  return 0;
}

int save_film(Call& call) {
  const auto figures = film(call);
  plot::save_film(figures, pause_of(call, 4), call.string(3, "file"));
  return 0;
}

/// Adds the curves of another figure, panel by panel.
void put_into(plot::Figure& f, const plot::Figure& other) {
  if (f.three_d || other.three_d) throw Error("curves of 3-D figures cannot be put together");
  if (f.below.size() != other.below.size())
    throw Error(text("one figure has ", f.below.size() + 1, f.below.empty() ? " panel" : " panels",
                     ", the other ", other.below.size() + 1));
  for (std::size_t k = 0; k < f.below.size(); ++k) put_into(f.below[k], other.below[k]);
  f.series.insert(f.series.end(), other.series.begin(), other.series.end());
  f.rules.insert(f.rules.end(), other.rules.begin(), other.rules.end());
  f.texts.insert(f.texts.end(), other.texts.begin(), other.texts.end());
  f = plot::checked(std::move(f));
}

/// fig:with(other): the curves of both.
int with(Call& call) {
  plot::Figure f = figure_of(call);
  put_into(f, call.object<plot::Figure>(2, "other"));
  return call.push(std::make_shared<const plot::Figure>(std::move(f)));
}

/// fig:page(columns, { figures }): this figure and others on one page.
int page(Call& call) {
  plot::Figure f = figure_of(call);
  f.columns = static_cast<int>(call.integer(2, "columns"));
  read_figures(call, 3, f.below);
  for (const plot::Figure& panel : f.below)
    if (panel.three_d || f.three_d || !panel.below.empty())
      throw Error("pages are made of 2-D figures of one panel each");
  return call.push(std::make_shared<const plot::Figure>(std::move(f)));
}

/// The text of an expression for axes and legends.
int label_text(Call& call) { return call.push(words(call.L, 1, "label")); }

int describe_figure(Call& call) { return call.push(plot::describe(figure_of(call))); }
int title(Call& call) { return call.push(figure_of(call).title); }

int notes(Call& call) { return push_texts(call.L, figure_of(call).notes); }

int labels(Call& call) {
  std::vector<std::string> all;
  for (const auto& s : figure_of(call).series) all.push_back(s.label);
  return push_texts(call.L, all);
}

}  // namespace

extern const Module plot_module = {
    "plot",
    "Looking at things",
    {
        {"figure", figure, "figure{ series = { { x =, y =, labels =, style = }, … }, … } -> figure",
         R"(A figure written out, as plot, plot3 and the others make it: every series has columns x and y (and z, or
            points = n×3 matrix, with three_d = true); y may have several columns.)",
         "figure{ series = { { x = {1, 2, 3}, y = {1, 4, 9}, labels = {\"squares\"} } }, title = "
         "\"Powers\" }",
         "figure 'Powers': 1 series, 3 points", &figure_option_rows()},
        {"sphere", sphere, "sphere(radius [, center]) -> surface",
         "A sphere for plot3{ surfaces = … }. The radius may be a parameter with a default value.",
         "sphere(1)", "surface: 25×49 nodes"},
        {"surface", surface, "surface(f, {u0, u1}, {v0, v1} [, n]) -> surface",
         R"(A surface for plot3{ surfaces = … }: f(x, y) returns z, or f(u, v) returns x, y, z; n pieces
            per side (24). Or surface(x, y, z) from three matrices, one entry per node.)",
         "surface(function(x, y) return x*x - y*y end, {-1, 1}, {-1, 1}, 10)", "surface: 11×11 nodes"},
        {"surface#x", grid<&plot::Surface::x>, "surface.x -> matrix", "x at the nodes.", "", ""},
        {"surface#y", grid<&plot::Surface::y>, "surface.y -> matrix", "y at the nodes.", "", ""},
        {"surface#z", grid<&plot::Surface::z>, "surface.z -> matrix", "z at the nodes.", "", ""},
        {"surface:__tostring", surface_text, "tostring(surface)", "The size of its grid."},
        {"figure:show", show, "fig:show()",
         R"(Draws the figure in the terminal; in a pipe 80 columns wide, without colours. At the prompt a
            figure that is the value of a line is shown by itself.)",
         R"(plot({0, 1, 4, 9}, { title = "Squares" }):show())"},
        {"figure:save", save, "fig:save(file) -> fig",
         "Writes the figure to a file through gnuplot; the extension says the format: .svg, .png or .pdf.",
         R"(plot({0, 1, 4, 9}):save(os.tmpname() .. ".svg"))", "figure: 1 series, 4 points"},
        {"figure:svg", svg, "fig:svg([{ others }]) -> string, or list of strings",
         R"(The SVG text that :save "file.svg" writes; with a list of other figures the texts of this one and
            of those, for which gnuplot is started once.)",
         R"(plot({0, 1, 4, 9}):svg():match "<svg")", "<svg"},
        {"figure:play", play, "fig:play({ figures } [, pause])",
         R"(Draws this figure and the others one after the other in the same place of the terminal, `pause`
            seconds apart (0.04).)",
         R"(
             frames = {}
             for k = 1, 3 do frames[k] = plot({0, k, 4*k}) end
             plot({0, 0, 0}):play(frames, 0.01))"},
        {"figure:film", save_film, "fig:film({ figures }, file [, pause])",
         "Writes this figure and the others as an animated GIF, `pause` seconds apart (0.04).",
         R"(
             frames = {}
             for k = 1, 3 do frames[k] = plot({0, k, 4*k}) end
             plot({0, 0, 0}):film(frames, os.tmpname() .. ".gif", 0.1))"},
        {"figure:parts", figure_parts, "fig:parts() -> table",
         "The table from which figure{…} makes the same figure. save writes it.",
         "return figure(plot{0, 1, 4}:parts())", "figure: 1 series, 3 points"},
        {"figure:with", with, "fig:with(other) -> figure", "The curves of both figures in one: see overlay.",
         "plot({0, 1, 4}):with(plot({4, 1, 0}))", "figure: 2 series, 6 points"},
        {"figure:page", page, "fig:page(columns, { figures }) -> figure",
         "This figure and others on one page: see layout.", "plot({0, 1, 4}):page(2, { plot({4, 1, 0}) })",
         "figure: 1 series, 3 points, 2 panels"},
        {"label_text", label_text, "label_text(expression) -> string",
         "The words that axes and legends show for an expression: its label and unit where it is a variable.",
         "label_text(var(\"p\", { text = \"pressure\", unit = \"bar\" }))", "pressure [bar]"},
        {"figure:text", drawing_text, "fig:text([columns]) -> string",
         "The terminal drawing without colours, 80 columns wide by default.",
         R"(plot({0, 1, 4}):text(40):match("┌"))", "┌"},
        {"figure:__tostring", describe_figure, "tostring(fig)", "The contents of the figure, in one line."},
        {"figure#title", title, "fig.title", "Its title, or an empty string."},
        {"figure#labels", labels, "fig.labels", "The labels of its series, as a list."},
        {"figure#notes", notes, "fig.notes",
         "The notes under the figure, as a list: points that could not be drawn, and other remarks.",
         "#plot({1, 0/0, 3}).notes", "1"},
    }};

}  // namespace pendula::lua
