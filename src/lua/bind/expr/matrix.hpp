// Reading the matrix of a call, whichever store it has.
#pragma once

#include "lua/bind/expr/expr.hpp"

namespace pendula::lua {

/// Calls visitor(m) with the MatX or Mat of argument 1.
template <class Visitor>
int visit(Call& call, const Visitor& visitor) {
  return std::visit(visitor, call.object<Matrix>(1, "matrix").store);
}

inline int push_entry(lua_State* L, Expr e) { return push_expr(L, e); }
inline int push_entry(lua_State* L, double value) {
  lua_pushnumber(L, value);
  return 1;
}

}  // namespace pendula::lua
