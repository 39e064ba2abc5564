// Physical dimensions of units and expressions.
//
// A dimension is the exponents of the seven base units of the SI. That of an expression follows from those of
// its leaves; where two terms of a sum, two sides of a comparison or of an equation have different ones, both
// are named. Leaves without a unit fit everything. Numbers of a model are never converted.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// Exponents of m, kg, s, A, K, mol, cd; angles have none.
using Dimension = std::array<double, 7>;

/// "N*m/rad", "m^3/(s*Pa^(1/2))", "1/s": factors with exponents; nothing for text that is no unit.
std::optional<Dimension> parse_unit(std::string_view text);
/// "V", "N*m", "kg*m/s^3": a name where there is one, else base units.
std::string unit_text(const Dimension& d);

/// Two parts of an expression that are added, compared or equated although their dimensions differ.
struct DimensionClash {
  Expr left, right;
  Dimension left_dimension, right_dimension;
};

/// The first clash in 0 = left - right, or nothing.
///
/// Symbols without a unit, t and what is multiplied by them fit everything; numbers have no dimension where
/// something that has one stands beside them, and fit everything where not. Arguments of exp, sin and the
/// like have to be without dimension. A derivative by time divides by s.
std::optional<DimensionClash> dimension_clash(Expr left, Expr right);

}  // namespace pendula::dae
