// Reading what figure{…} is given: series, axes, rules, texts, legends.
//
// The folder is the way from Lua to src/plot: plot (stdlib/plot.lua) turns solutions, systems and data into
// the table that figure{…} takes; figure_reader.hpp (here) reads it, figure_parts.cpp the parts of it,
// plot.cpp has the methods of figures. Messages name the entry of the table that is wrong.
#pragma once

#include <string>

#include "lua/core/trampoline.hpp"
#include "plot/figure.hpp"

namespace pendula::lua {

template <>
struct TypeName<plot::Figure> {
  static constexpr const char* value = "figure";
};
template <>
struct TypeName<plot::Surface> {
  static constexpr const char* value = "surface";
};

/// The options of figure{…}; stdlib/plot/options.lua takes those of plot from them.
const OptionTable& figure_option_rows();

/// The table at argument 1 as a checked figure. Throws Error that names the entry.
plot::Figure read_figure(Call& call);

/// The table that read_figure makes the same figure of.
int figure_parts(Call& call);

/// Words for a label: a string, or an expression, which is called by its label and unit (x: "position [m]").
std::string words(lua_State* L, int index, const std::string& what);

/// A number, also one that follows from the default values of parameters (R in sphere(R)).
double number_with_defaults(lua_State* L, int index, const std::string& what);

}  // namespace pendula::lua
