// Substitution, and the shape-independent way to do the same to every entry.
#pragma once

#include "lua/bind/expr/expr.hpp"

namespace pendula::lua {

/// func("g", m): applied to arguments it gives calls with formal partial derivatives.
struct UnspecifiedFunction {
  std::string name;
  int outputs;
};
template <>
struct TypeName<UnspecifiedFunction> {
  static constexpr const char* value = "func";
};
/// "g", or "g2" for the second of several outputs.
inline std::string output_name(const UnspecifiedFunction& f, int output) {
  return f.outputs == 1 ? f.name : f.name + std::to_string(output + 1);
}

int push_substituted(Call& call);

/// f on an expression, on every entry of a matrix or a list, on both sides of an equation.
template <class F>
int each(Call& call, const F& f) {
  if (call.is<Equation>(1)) {
    Equation equation = call.object<Equation>(1, "equation");
    equation.lhs = f(equation.lhs);
    equation.rhs = f(equation.rhs);
    return push_equation(call.L, std::move(equation));
  }
  if (call.is<Matrix>(1) && call.object<Matrix>(1, "e").numeric()) {
    lua_settop(call.L, 1);
    return 1;
  }
  return push_value(call.L, f(to_matrix(call.L, 1, "e")));
}

}  // namespace pendula::lua
