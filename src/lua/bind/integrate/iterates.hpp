// Common parts of the results of newton and gauss_newton: numbers of every iterate, some of them unknown.
#pragma once

#include <vector>

#include "lua/core/values.hpp"

namespace pendula::lua {

inline int push_column(Call& call, const std::vector<double>& values) {
  return push_matrix(call.L,
                     Mat(Eigen::Map<const Vec>(values.data(), static_cast<Eigen::Index>(values.size()))));
}

inline int push_or_nil(Call& call, bool known, double value) {
  if (!known) return call.push_nil();
  return call.push(value);
}

}  // namespace pendula::lua
