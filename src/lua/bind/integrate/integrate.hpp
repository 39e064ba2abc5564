// What other bindings need to know about tableaus and solutions in Lua.
#pragma once

#include "integrate/run/simulate.hpp"
#include "lua/core/call.hpp"

namespace pendula::lua {

template <>
struct TypeName<integrate::Tableau> {
  static constexpr const char* value = "tableau";
};
template <>
struct TypeName<integrate::Trajectory> {
  static constexpr const char* value = "solution";
};

}  // namespace pendula::lua
