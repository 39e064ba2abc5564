// Shared by the bindings of methods: their Lua types, and reading coefficients.
#pragma once

#include "lua/bind/integrate/integrate.hpp"
#include "lua/core/call.hpp"
#include "method/multistep.hpp"
#include "method/rosenbrock.hpp"

namespace pendula::lua {

template <>
struct TypeName<integrate::Multistep> {
  static constexpr const char* value = "multistep";
};
template <>
struct TypeName<integrate::Rosenbrock> {
  static constexpr const char* value = "rosenbrock";
};

/// A number, an expression of numbers, or a string such as "sqrt(3)/6-(1/2)".
/// Throws Error beginning with `what`.
Expr read_entry(lua_State* L, int index, const std::string& what);

/// A list of entries.
VecX read_list(lua_State* L, int index, const std::string& what);

/// A list of `rows` lists of at most `columns` entries, zeros added at their
/// ends; rows < 0: as many as there are.
MatX read_rows(lua_State* L, int index, const std::string& what, Eigen::Index rows, Eigen::Index columns);

}  // namespace pendula::lua
