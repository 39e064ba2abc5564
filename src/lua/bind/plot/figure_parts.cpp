// Converts a figure to the table that figure{…} reads.
#include "lua/bind/plot/figure_reader.hpp"

#include <algorithm>
#include "lua/core/values.hpp"

namespace pendula::lua {
namespace {

using Eigen::Index;

void set_flag(lua_State* L, const char* key, bool value) {
  if (!value) return;
  lua_pushboolean(L, 1);
  lua_setfield(L, -2, key);
}
void set_words(lua_State* L, const char* key, const std::string& value) {
  if (value.empty()) return;
  lua_pushlstring(L, value.data(), value.size());
  lua_setfield(L, -2, key);
}
void set_number(lua_State* L, const char* key, double value) {
  lua_pushnumber(L, value);
  lua_setfield(L, -2, key);
}
void set_column(lua_State* L, const char* key, const Vec& value) {
  if (value.size() == 0) return;
  push_matrix(L, Mat(value));
  lua_setfield(L, -2, key);
}
void set_pair(lua_State* L, const char* key, double a, double b) {
  lua_createtable(L, 2, 0);
  lua_pushnumber(L, a);
  lua_rawseti(L, -2, 1);
  lua_pushnumber(L, b);
  lua_rawseti(L, -2, 2);
  lua_setfield(L, -2, key);
}
void set_limits(lua_State* L, const char* key, const std::optional<plot::Range>& range) {
  if (range) set_pair(L, key, range->low, range->high);
}
/// Row numbers, counted from 1.
void set_rows(lua_State* L, const char* key, const std::vector<Index>& rows) {
  Vec numbers(static_cast<Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) numbers[i] = static_cast<double>(rows[i] + 1);
  set_column(L, key, numbers);
}

/// A list whose i-th entry `push` pushes.
template <class List, class Push>
void set_list(lua_State* L, const char* key, const List& list, const Push& push) {
  if (list.empty()) return;
  luaL_checkstack(L, 8, nullptr);
  lua_createtable(L, static_cast<int>(list.size()), 0);
  lua_Integer i = 0;
  for (const auto& item : list) {
    push(item);
    lua_rawseti(L, -2, ++i);
  }
  lua_setfield(L, -2, key);
}

template <class Name>
const std::string& name_of(const std::vector<std::string>& names, Name name) {
  return names.at(static_cast<std::size_t>(name));
}

void push_series(lua_State* L, const plot::Series& s) {
  lua_newtable(L);
  set_column(L, "x", s.x);
  set_column(L, "y", s.y);
  set_column(L, "z", s.z);
  if (!s.label.empty())
    set_list(L, "labels", std::vector{s.label},
             [&](const std::string& label) { lua_pushstring(L, label.c_str()); });
  set_words(L, "style", name_of(plot::style_names(), s.style));
  set_pair(L, "cell", s.cell[0], s.cell[1]);
  set_words(L, "colour", s.colour);
  if (s.width > 0) set_number(L, "width", s.width);
  set_words(L, "dash", name_of(plot::dash_names(), s.dash));
  set_words(L, "marker", name_of(plot::mark_names(), s.mark));
  set_column(L, "value", s.value);
  set_column(L, "lower", s.lower);
  set_rows(L, "breaks", s.breaks);
  set_rows(L, "marked", s.marked);
}

void set_rules(lua_State* L, const char* key, int axis, const plot::Figure& f) {
  std::vector<plot::Rule> rules;
  for (const plot::Rule& rule : f.rules)
    if (rule.axis == axis) rules.push_back(rule);
  set_list(L, key, rules, [&](const plot::Rule& rule) {
    lua_newtable(L);
    lua_pushnumber(L, rule.at);
    lua_rawseti(L, -2, 1);
    if (rule.label.empty()) return;
    lua_pushstring(L, rule.label.c_str());
    lua_rawseti(L, -2, 2);
  });
}

void set_axes(lua_State* L, const plot::Figure& f) {
  const char* const labels[] = {"xlabel", "ylabel", "zlabel"};
  const char* const limits[] = {"xlim", "ylim", "zlim"};
  for (std::size_t a = 0; a < 3; ++a) {
    set_words(L, labels[a], f.axes[a].label);
    set_limits(L, limits[a], f.axes[a].limits);
  }
  set_flag(L, "xlog", f.axes[0].log);
  set_flag(L, "ylog", f.axes[1].log);
  set_flag(L, "xwhole", f.axes[0].whole);
  set_flag(L, "ywhole", f.axes[1].whole);
  set_flag(L, "yreversed", f.axes[1].reversed);
  set_number(L, "xstep", f.axes[0].step);
  set_number(L, "ystep", f.axes[1].step);
  if (!f.right) return;
  set_limits(L, "right", f.right->limits);
  set_words(L, "y2label", f.right->label);
}

/// The notes that `checked` does not add itself.
std::vector<std::string> own_notes(const plot::Figure& f) {
  plot::Figure bare = f;
  bare.notes.clear();
  bare.below.clear();
  const std::vector<std::string> found = plot::checked(std::move(bare)).notes;
  std::vector<std::string> own;
  for (const auto& note : f.notes)
    if (std::find(found.begin(), found.end(), note) == found.end()) own.push_back(note);
  return own;
}

}  // namespace

int figure_parts(Call& call) {
  lua_State* L = call.L;
  const auto& f = call.object<plot::Figure>(1, "figure");
  lua_newtable(L);
  set_words(L, "title", f.title);
  set_axes(L, f);
  set_flag(L, "three_d", f.three_d);
  set_flag(L, "equal", f.equal);
  lua_pushboolean(L, f.grid);
  lua_setfield(L, -2, "grid");
  set_words(L, "legend", f.legend ? name_of(plot::legend_places(), f.legend_at) : "none");
  set_words(L, "theme", f.dark ? "dark" : "light");
  set_words(L, "value_label", f.value_label);
  set_pair(L, "view", f.tilt, f.turn);
  if (f.size[0] > 0) set_pair(L, "size", f.size[0], f.size[1]);
  set_number(L, "columns", f.columns);
  set_list(L, "series", f.series, [&](const plot::Series& s) { push_series(L, s); });
  set_list(L, "surfaces", f.surfaces,
           [&](const plot::Surface& s) { call.push(std::make_shared<const plot::Surface>(s)); });
  set_rules(L, "hlines", 1, f);
  set_rules(L, "vlines", 0, f);
  set_list(L, "texts", f.texts, [&](const plot::Words& words) {
    lua_newtable(L);
    lua_pushnumber(L, words.x);
    lua_rawseti(L, -2, 1);
    lua_pushnumber(L, words.y);
    lua_rawseti(L, -2, 2);
    lua_pushstring(L, words.text.c_str());
    lua_rawseti(L, -2, 3);
  });
  set_list(L, "notes", own_notes(f), [&](const std::string& note) { lua_pushstring(L, note.c_str()); });
  set_list(L, "below", f.below,
           [&](const plot::Figure& panel) { call.push(std::make_shared<const plot::Figure>(panel)); });
  return 1;
}

}  // namespace pendula::lua
