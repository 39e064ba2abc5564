// What eig(A) gives.
#pragma once

#include <optional>
#include <vector>

#include "expr/linalg/linalg.hpp"
#include "lua/core/call.hpp"

namespace pendula::lua {

/// eig(A): eigenvalues, exact where they could be, and right eigenvectors in doubles.
struct Eigenvalues {
  linalg::Eigensystem numeric;
  std::optional<std::vector<linalg::Eigenvalue>> exact;
  bool real() const { return numeric.im.isZero(0); }
};
template <>
struct TypeName<Eigenvalues> {
  static constexpr const char* value = "eigenvalues";
};

}  // namespace pendula::lua
