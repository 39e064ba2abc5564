#include "lua/bind/plot/figure_reader.hpp"

#include <array>
#include <optional>
#include <unordered_map>

#include "expr/graph/derivative.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

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

namespace {

using Eigen::Index;

/// Numbers as columns, from a list or a numeric matrix; a single row is taken as a column. All
/// data enter here.
Mat columns(lua_State* L, int index, const std::string& what) {
  Mat m = to_numeric_matrix(L, index, what);
  if (m.rows() == 1 && m.cols() > 1) m.transposeInPlace();
  return m;
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
  /// Reads colour, width, dash, marker, breaks and marked rows, common to all curves of the series.
  void read_look() {
    if (field("colour")) look_.colour = plot::colour_named(words(L_, lua_gettop(L_), "colour"));
    if (field("dash")) look_.dash = plot::dash_named(words(L_, lua_gettop(L_), "dash"));
    if (field("marker")) look_.mark = plot::mark_named(words(L_, lua_gettop(L_), "marker"));
    if (field("width")) {
      look_.width = to_number(L_, lua_gettop(L_), "width");
      if (!(look_.width > 0 && look_.width <= 50)) throw Error("width must lie between 0 and 50 pixels");
    }
    if (field("value")) look_.value = to_numeric_matrix(L_, lua_gettop(L_), "value").reshaped();
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
  plot::Series look_;  ///< properties common to all curves of the series
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

void read_theme(const Options& o, plot::Figure& f) {
  const std::string theme = o.string("theme", "light");
  if (theme != "light" && theme != "dark")
    throw Error(text("unknown theme '", theme, "'; themes are \"light\" and \"dark\""));
  f.dark = theme == "dark";
}

}  // namespace

const OptionTable& figure_option_rows() {
  static const OptionTable rows = {
      {"series", "list of tables", "", "the curves: { { x =, y =, labels =, style = }, … }"},
      {"title", "string or expression", "", "the title above the frame"},
      {"xlabel", "string or expression", "", "the label of the axis; an expression brings its unit"},
      {"ylabel", "string or expression", "", "the same of the y axis"},
      {"zlabel", "string or expression", "", "the same of the z axis"},
      {"legend", "boolean or string", "", "whether there is one, or its place",
       "top left|top right|bottom left|bottom right|above|right|below|none"},
      {"xlim", "list", "", "{ low, high }: the range that is shown"},
      {"ylim", "list", "", "the same of the y axis"},
      {"zlim", "list", "", "the same of the z axis"},
      {"xlog", "boolean", "false", "logarithmic axis"},
      {"ylog", "boolean", "false", "logarithmic axis"},
      {"xwhole", "boolean", "false", "ticks at whole numbers only"},
      {"ywhole", "boolean", "false", "ticks at whole numbers only"},
      {"yreversed", "boolean", "false", "the axis points downwards"},
      {"xstep", "number", "", "distance of the ticks"},
      {"ystep", "number", "", "distance of the ticks"},
      {"grid", "boolean", "true", "thin lines at the ticks"},
      {"hlines", "number or list", "", "lines across the frame: { 0, { 1, \"limit\" } }"},
      {"vlines", "number or list", "", "the same from bottom to top"},
      {"texts", "list", "", "words at places: { { x, y, \"words\" } }"},
      {"equal", "boolean", "false", "one unit is equally long on all axes"},
      {"size", "list", "{800, 500}", "{ width, height } in pixels"},
      {"notes", "list", "", "small lines of text below the frame"},
      {"three_d", "boolean", "false", "points have three coordinates"},
      {"view", "list", "{60, 30}", "{ tilt, turn } in degrees: where it is seen from"},
      {"surfaces", "list", "", "transparent nets: { sphere(1) }"},
      {"theme", "string", "\"light\"", "colours of the page", "light|dark"},
      {"right", "list", "", "{ low, high }: the range of an axis on the right"},
      {"y2label", "string or expression", "", "the label of that axis"},
      {"value_label", "string or expression", "", "the label of the scale of colours"},
      {"below", "list", "", "figures that are panels under this one"},
      {"columns", "integer", "1", "how many panels are in a row"},
      {"by", "string", "", "the name of the function in errors"},
  };
  return rows;
}

plot::Figure read_figure(Call& call) {
  lua_State* L = call.L;
  call.table(1, "description");
  const Options o = call.options(1);
  plot::Figure f;
  f.title = words_option(call, o, "title");
  f.three_d = o.boolean("three_d", false);
  f.equal = o.boolean("equal", false);
  read_legend(call, o, f);
  read_theme(o, f);
  f.value_label = words_option(call, o, "value_label");
  if (const auto limits = pair_option(call, o, "right")) {
    f.right = plot::Axis{};
    f.right->label = words_option(call, o, "y2label");
    f.right->limits = plot::Range{(*limits)[0], (*limits)[1]};
  }
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

}  // namespace pendula::lua
