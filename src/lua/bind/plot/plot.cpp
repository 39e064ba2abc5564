// The `plot` module: figures from tables of columns. The friendly functions (plot, plot3, semilogy, …) are in
// stdlib/plot.lua; they all end in figure{…} here.
#include <array>
#include <cstdio>
#include <optional>
#include <unordered_map>

#include <unistd.h>

#include "expr/graph/derivative.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"
#include "lua/core/values.hpp"
#include "plot/braille.hpp"
#include "plot/figure.hpp"
#include "plot/gnuplot.hpp"

namespace pendula::lua {

template <>
struct TypeName<plot::Figure> {
  static constexpr const char* value = "figure";
};
template <>
struct TypeName<plot::Surface> {
  static constexpr const char* value = "surface";
};

namespace {

using Eigen::Index;

/// Numbers as columns: a list, a numeric matrix; a single row is taken as a
/// column. The one place where data enter.
Mat columns(lua_State* L, int index, const std::string& what) {
  Mat m = to_numeric_matrix(L, index, what);
  if (m.rows() == 1 && m.cols() > 1) m.transposeInPlace();
  return m;
}

/// A number, also one that follows from the default values of parameters (R in sphere(R)).
double number_with_defaults(lua_State* L, int index, const std::string& what) {
  if (lua_type(L, index) == LUA_TNUMBER) return lua_tonumber(L, index);
  const Expr e = to_expr(L, index, what);
  std::unordered_map<Expr, double> values;
  for (Expr node : topological({&e, 1})) {
    if (!node.is_symbol() || symbol_of(node).kind == Kind::constant) continue;
    const auto& fallback = symbol_of(node).value;
    if (!fallback || !number_value(*fallback))
      return to_number(L, index, what);  // throws: it is an expression
    values[node] = *number_value(*fallback);
  }
  return evaluate({&e, 1}, values)[0];
}

/// Words for a label: a string, or an expression, which is called by its label and unit (x: "position [m]").
std::string words(lua_State* L, int index, const std::string& what) {
  if (lua_type(L, index) == LUA_TSTRING) {
    size_t size = 0;
    const char* bytes = lua_tolstring(L, index, &size);
    return {bytes, size};
  }
  const auto* expression = object_at(L, index, TypeName<Expr>::value);
  if (expression && *expression) return label_of(*static_cast<const Expr*>(expression->get()));
  if (!object_at(L, index, TypeName<Matrix>::value))
    throw Error(text(what, " must be a string or an expression, not ", describe(L, index)));
  std::string shown = luaL_tolstring(L, index, nullptr);
  lua_pop(L, 1);
  for (char& c : shown)
    if (c == '\n') c = ' ';
  return shown;
}

std::string words_option(Call& call, const Options& options, const char* key) {
  if (!options.has(key)) return "";
  const std::string found = words(call.L, options.push(key), text("option '", key, "'"));
  lua_pop(call.L, 1);
  return found;
}

/// Reads the fields of a table that describes one series; in Lua:
/// { x = column, y = matrix [, z = column], labels = {…}, style = "line" } or { points = n×3 matrix, … }.
class SeriesReader {
 public:
  SeriesReader(lua_State* L, int table, plot::Figure& figure) : L_(L), table_(table), figure_(figure) {}

  void read() {
    if (field("style")) style_ = plot::style_named(words(L_, lua_gettop(L_), "style"));
    if (field("cell")) {
      const Vec size = to_numbers(L_, lua_gettop(L_), "cell");
      if (size.size() != 2 || !(size.minCoeff() > 0))
        throw Error("cell must be { width, height }, both positive");
      cell_ = {size[0], size[1]};
    }
    read_look();
    read_labels();
    if (field("points")) return read_points();
    const Mat x = field("x") ? columns(L_, lua_gettop(L_), "x") : Mat();
    if (!field("y")) throw Error("every series needs y = {…}");
    const Mat y = columns(L_, lua_gettop(L_), "y");
    const Mat z = field("z") ? columns(L_, lua_gettop(L_), "z") : Mat();
    if (x.cols() > 1) throw Error(text("x must be one column of numbers, but it has ", x.cols(), " columns"));
    if (z.cols() > 1) throw Error(text("z must be one column of numbers, but it has ", z.cols(), " columns"));
    const Vec along = x.size() || field("x")
                          ? Vec(x.reshaped())
                          : Vec(Vec::LinSpaced(y.rows(), 1, static_cast<double>(y.rows())));
    if (field("lower")) {
      const Mat lower = columns(L_, lua_gettop(L_), "lower");
      if (lower.cols() != 1)
        throw Error(text("lower must be one column, but it has ", lower.cols(), " columns"));
      look_.lower = lower.col(0);
    }
    for (Index j = 0; j < std::max<Index>(1, y.cols()); ++j)
      add(along, y.cols() ? Vec(y.col(j)) : Vec(), z.reshaped());
  }

 private:
  /// Pushes a field; false (and nothing pushed) if it is nil.
  bool field(const char* key) {
    luaL_checkstack(L_, 6, nullptr);
    lua_pushstring(L_, key);
    if (lua_rawget(L_, table_) != LUA_TNIL) return true;
    lua_pop(L_, 1);
    return false;
  }
  /// colour, width, dash, marker, breaks and marked rows: the same for all curves of the series.
  void read_look() {
    if (field("colour")) look_.colour = plot::colour_named(words(L_, lua_gettop(L_), "colour"));
    if (field("dash")) look_.dash = plot::dash_named(words(L_, lua_gettop(L_), "dash"));
    if (field("marker")) look_.mark = plot::mark_named(words(L_, lua_gettop(L_), "marker"));
    if (field("width")) {
      look_.width = to_number(L_, lua_gettop(L_), "width");
      if (!(look_.width > 0 && look_.width <= 50)) throw Error("width must lie between 0 and 50 pixels");
    }
    if (field("breaks")) look_.breaks = rows("breaks");
    if (field("marked")) look_.marked = rows("marked");
  }
  /// A list of row numbers from 1, as indices from 0.
  std::vector<Index> rows(const char* what) {
    std::vector<Index> list;
    const Vec numbers = to_numbers(L_, lua_gettop(L_), what);
    for (double number : numbers) list.push_back(static_cast<Index>(number) - 1);
    return list;
  }
  void read_labels() {
    if (!field("labels")) return;
    if (!lua_istable(L_, -1)) throw Error(text("labels must be a list of strings, not ", describe(L_, -1)));
    const int list = lua_gettop(L_);
    for (lua_Integer i = 1, n = list_size(L_, list, "labels"); i <= n; ++i) {
      lua_rawgeti(L_, list, i);
      labels_.push_back(words(L_, lua_gettop(L_), "a label"));
      lua_pop(L_, 1);
    }
  }
  void read_points() {
    const Mat p = to_numeric_matrix(L_, lua_gettop(L_), "the points");
    if (p.cols() != 3)
      throw Error(
          text("a curve in space needs three numbers per row, but this matrix is ", p.rows(), "×", p.cols()));
    add(p.col(0), p.col(1), p.col(2));
  }
  void add(Vec x, Vec y, Vec z) {
    const std::string label = added_ < labels_.size() ? labels_[added_] : "";
    plot::Series s = look_;
    s.label = label;
    s.x = std::move(x);
    s.y = std::move(y);
    s.z = std::move(z);
    s.style = style_;
    s.cell = cell_;
    figure_.series.push_back(std::move(s));
    ++added_;
  }

  lua_State* L_;
  int table_;
  plot::Figure& figure_;
  plot::Style style_ = plot::Style::line;
  plot::Series look_;  ///< what all curves of the series have in common
  std::array<double, 2> cell_{0.9, 0.9};
  std::vector<std::string> labels_;
  size_t added_ = 0;
};

/// Visits the entries of a list option; inside, the entry is on top of the stack.
template <class Visit>
void each_item(Call& call, const Options& options, const char* key, const Visit& visit) {
  if (!options.has(key)) return;
  lua_State* L = call.L;
  const int list = options.push(key);
  if (!lua_istable(L, list))
    throw Error(text("option '", key, "': expected a list, got ", describe(L, list)));
  for (lua_Integer i = 1, n = list_size(L, list, key); i <= n; ++i) {
    lua_rawgeti(L, list, i);
    visit(lua_gettop(L), i);
    lua_settop(L, list);
  }
  lua_settop(L, list - 1);
}

/// Two numbers {a, b}, or nothing.
std::optional<std::array<double, 2>> pair_option(Call& call, const Options& options, const char* key) {
  if (!options.has(key)) return {};
  std::vector<double> values;
  each_item(call, options, key, [&](int at, lua_Integer i) {
    values.push_back(number_with_defaults(call.L, at, text(key, "[", i, "]")));
  });
  if (values.size() != 2)
    throw Error(text("option '", key, "': expected two numbers { a, b }, got ", values.size()));
  return std::array{values[0], values[1]};
}

void read_axes(Call& call, const Options& o, plot::Figure& f) {
  const char* const labels[] = {"xlabel", "ylabel", "zlabel"};
  const char* const limits[] = {"xlim", "ylim", "zlim"};
  for (size_t a = 0; a < 3; ++a) {
    f.axes[a].label = words_option(call, o, labels[a]);
    if (const auto pair = pair_option(call, o, limits[a]))
      f.axes[a].limits = plot::Range{(*pair)[0], (*pair)[1]};
  }
  f.axes[0].log = o.boolean("xlog", false);
  f.axes[1].log = o.boolean("ylog", false);
  f.axes[0].whole = o.boolean("xwhole", false);
  f.axes[1].whole = o.boolean("ywhole", false);
  f.axes[1].reversed = o.boolean("yreversed", false);
  f.axes[0].step = o.number("xstep", 0);
  f.axes[1].step = o.number("ystep", 0);
  if (const auto view = pair_option(call, o, "view")) {
    f.tilt = (*view)[0];
    f.turn = (*view)[1];
  }
  if (const auto size = pair_option(call, o, "size"))
    for (size_t k = 0; k < 2; ++k) {
      if (!((*size)[k] >= 1 && (*size)[k] <= 1e6))
        throw Error("option 'size': expected { width, height } in pixels");
      f.size[k] = static_cast<int>((*size)[k]);
    }
}

/// hlines = {0, {1, "limit"}}: numbers, or a number with its label.
void read_rules(Call& call, const Options& o, const char* key, int axis, plot::Figure& f) {
  if (!o.has(key)) return;
  lua_State* L = call.L;
  const int value = o.push(key);
  if (!lua_istable(L, value)) {
    f.rules.push_back({axis, number_with_defaults(L, value, key), ""});
    lua_settop(L, value - 1);
    return;
  }
  lua_settop(L, value - 1);
  each_item(call, o, key, [&](int at, lua_Integer i) {
    plot::Rule rule{axis, 0, ""};
    const std::string what = text(key, "[", i, "]");
    if (lua_istable(L, at)) {
      lua_rawgeti(L, at, 2);
      if (!lua_isnil(L, -1)) rule.label = words(L, lua_gettop(L), what);
      lua_rawgeti(L, at, 1);
      rule.at = number_with_defaults(L, lua_gettop(L), what);
    } else {
      rule.at = number_with_defaults(L, at, what);
    }
    f.rules.push_back(std::move(rule));
  });
}

/// texts = {{x, y, "words"}, …}
void read_texts(Call& call, const Options& o, plot::Figure& f) {
  lua_State* L = call.L;
  each_item(call, o, "texts", [&](int at, lua_Integer i) {
    if (!lua_istable(L, at) || luaL_len(L, at) != 3)
      throw Error(text("texts[", i, "] must be { x, y, \"words\" }"));
    plot::Words entry;
    for (int k = 1; k <= 3; ++k) lua_rawgeti(L, at, k);
    entry.x = number_with_defaults(L, at + 1, "x");
    entry.y = number_with_defaults(L, at + 2, "y");
    entry.text = words(L, at + 3, "the words");
    f.texts.push_back(std::move(entry));
  });
}

/// legend = true, false, or a place.
void read_legend(Call& call, const Options& o, plot::Figure& f) {
  if (!o.has("legend")) return;
  const int at = o.push("legend");
  if (lua_isboolean(call.L, at)) {
    f.legend = lua_toboolean(call.L, at) != 0;
  } else {
    f.legend_at = plot::legend_place_named(words(call.L, at, "legend"));
    f.legend = f.legend_at != plot::LegendPlace::none;
  }
  lua_settop(call.L, at - 1);
}

plot::Figure read_figure(Call& call) {
  lua_State* L = call.L;
  call.table(1, "description");
  const Options o =
      call.options(1, {"series",  "surfaces", "title",  "xlabel", "ylabel", "zlabel",    "xlim",    "ylim",
                       "zlim",    "xlog",     "ylog",   "xwhole", "ywhole", "yreversed", "view",    "size",
                       "three_d", "equal",    "legend", "notes",  "by",     "below",     "columns", "grid",
                       "hlines",  "vlines",   "texts",  "xstep",  "ystep"});
  plot::Figure f;
  f.title = words_option(call, o, "title");
  f.three_d = o.boolean("three_d", false);
  f.equal = o.boolean("equal", false);
  read_legend(call, o, f);
  f.grid = o.boolean("grid", true);
  f.columns = static_cast<int>(o.integer("columns", 1));
  read_rules(call, o, "hlines", 1, f);
  read_rules(call, o, "vlines", 0, f);
  read_texts(call, o, f);
  read_axes(call, o, f);
  each_item(call, o, "series", [&](int at, lua_Integer i) {
    if (!lua_istable(L, at))
      throw Error(text("series ", i, " must be a table { x =, y = }, not ", describe(L, at)));
    SeriesReader(L, at, f).read();
  });
  each_item(call, o, "surfaces", [&](int at, lua_Integer i) {
    const auto* held = object_at(L, at, TypeName<plot::Surface>::value);
    if (!held || !*held)
      throw Error(text("surfaces[", i,
                       "] must be a surface, such as sphere(1) or surface(f, {0, 1}, {0, 1}), not ",
                       describe(L, at)));
    f.surfaces.push_back(*static_cast<const plot::Surface*>(held->get()));
  });
  each_item(call, o, "notes", [&](int at, lua_Integer) {
    if (lua_type(L, at) != LUA_TSTRING) throw Error(text("notes must be strings, not ", describe(L, at)));
    f.notes.emplace_back(lua_tostring(L, at));
  });
  each_item(call, o, "below", [&](int at, lua_Integer i) {
    const auto* held = object_at(L, at, TypeName<plot::Figure>::value);
    if (!held || !*held) throw Error(text("below[", i, "] must be a figure, not ", describe(L, at)));
    f.below.push_back(*static_cast<const plot::Figure*>(held->get()));
  });
  return plot::checked(std::move(f));
}

/// The function of stdlib/plot.lua that the user called: errors carry its name, not that of figure.
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
    for (Index i = 0; i < 3; ++i) center[static_cast<size_t>(i)] = c[i];
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
    s.x(i, j) = to_number(L, top + 1, "x"), s.y(i, j) = to_number(L, top + 2, "y"),
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

int surface_text(Call& call) {
  const auto& s = call.object<plot::Surface>(1, "surface");
  return call.push(text("surface: ", s.x.rows(), "×", s.x.cols(), " nodes"));
}

// ── methods of a figure ──

const plot::Figure& figure_of(Call& call) { return call.object<plot::Figure>(1, "figure"); }

int show(Call& call) {
  const std::string drawing = plot::draw(figure_of(call), plot::terminal_of(STDOUT_FILENO));
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
  const auto& figure = figure_of(call);  // before the file: the first wrong argument is named
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

/// fig:with(other): the curves of both.
int with(Call& call) {
  plot::Figure f = figure_of(call);
  const auto& other = call.object<plot::Figure>(2, "other");
  if (f.three_d || other.three_d) throw Error("curves of 3-D figures cannot be put together");
  f.series.insert(f.series.end(), other.series.begin(), other.series.end());
  f.rules.insert(f.rules.end(), other.rules.begin(), other.rules.end());
  f.texts.insert(f.texts.end(), other.texts.begin(), other.texts.end());
  return call.push(std::make_shared<const plot::Figure>(plot::checked(std::move(f))));
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

/// The words of an expression as axes and legends show them.
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
         R"(What plot, plot3 and the others make, written out: every series has columns x and y (and z, or
            points = n×3 matrix, with three_d = true); y may have several columns. Options: title, xlabel,
            ylabel, zlabel, xlim, ylim, zlim, xlog, ylog, xwhole, ywhole, yreversed, equal, legend, view =
            { tilt, turn }, size = { width, height }, surfaces, notes, below = { figures } (panels under
            this one).)",
         "figure{ series = { { x = {1, 2, 3}, y = {1, 4, 9}, labels = {\"squares\"} } }, title = "
         "\"Powers\" }",
         "figure 'Powers': 1 series, 3 points"},
        {"sphere", sphere, "sphere(radius [, center]) -> surface",
         "A sphere for plot3{ surfaces = … }. The radius may be a parameter with a default value.",
         "sphere(1)", "surface: 25×49 nodes"},
        {"surface", surface, "surface(f, {u0, u1}, {v0, v1} [, n]) -> surface",
         R"(A surface for plot3{ surfaces = … }: f(x, y) returns z, or f(u, v) returns x, y, z; n pieces
            per side (24). Or surface(x, y, z) from three matrices, one entry per node.)",
         "surface(function(x, y) return x*x - y*y end, {-1, 1}, {-1, 1}, 10)", "surface: 11×11 nodes"},
        {"surface:__tostring", surface_text, "tostring(surface)", "The size of its grid."},
        {"figure:show", show, "fig:show()",
         R"(Draws the figure in the terminal; in a pipe 80 columns wide, without colours. At the prompt a
            figure that is the value of a line is shown by itself.)"},
        {"figure:save", save, "fig:save(file) -> fig",
         "Writes the figure to a file through gnuplot; the extension says the format: .svg, .png or .pdf."},
        {"figure:svg", svg, "fig:svg([{ others }]) -> string, or list of strings",
         R"(The SVG text that :save "file.svg" writes; with a list of other figures the texts of this one and
            of those, for which gnuplot is started once.)"},
        {"figure:with", with, "fig:with(other) -> figure", "The curves of both figures in one: see overlay."},
        {"figure:page", page, "fig:page(columns, { figures }) -> figure",
         "This figure and others on one page: see layout."},
        {"label_text", label_text, "label_text(expression) -> string",
         "The words that axes and legends show for an expression: its label and unit where it is a variable.",
         "label_text(var(\"p\", { text = \"pressure\", unit = \"bar\" }))", "pressure [bar]"},
        {"figure:text", drawing_text, "fig:text([columns]) -> string",
         "The terminal drawing without colours, 80 columns wide unless told.",
         R"(plot({0, 1, 4}):text(40):match("┌"))", "┌"},
        {"figure:__tostring", describe_figure, "tostring(fig)", "What the figure holds, in one line."},
        {"figure#title", title, "fig.title", "Its title, or an empty string."},
        {"figure#labels", labels, "fig.labels", "The labels of its series, as a list."},
        {"figure#notes", notes, "fig.notes",
         "What could not be drawn and other remarks under the figure, as a list.", "#plot({1, 0/0, 3}).notes",
         "1"},
    }};

}  // namespace pendula::lua
