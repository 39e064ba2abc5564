// Common parts of the results of newton and gauss_newton: numbers of every iterate, some of them unknown.
#pragma once

#include <optional>
#include <vector>

#include "lua/core/values.hpp"

namespace pendula::lua {

inline int push_column(Call& call, const std::vector<double>& values) {
  return push_matrix(call.L,
                     Mat(Eigen::Map<const Vec>(values.data(), static_cast<Eigen::Index>(values.size()))));
}

inline int push_or_nil(Call& call, bool known, double value) {
  if (!known) return lua_pushnil(call.L), 1;
  return call.push(value);
}
inline int push_or_nil(Call& call, const std::optional<double>& value) {
  return push_or_nil(call, value.has_value(), value.value_or(0));
}

}  // namespace pendula::lua
