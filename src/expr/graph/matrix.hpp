// Matrices of expressions are Eigen matrices: the only matrix notation of the project.
#pragma once

#include <Eigen/Core>

#include "expr/graph/graph.hpp"

namespace Eigen {
template <>
struct NumTraits<pendula::Expr> : GenericNumTraits<pendula::Expr> {
  using Real = pendula::Expr;
  using NonInteger = pendula::Expr;
  using Nested = pendula::Expr;
  using Literal = pendula::Expr;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 40,
    MulCost = 40
  };
};
}  // namespace Eigen

namespace pendula {

using MatX = Eigen::Matrix<Expr, Eigen::Dynamic, Eigen::Dynamic>;
using VecX = Eigen::Matrix<Expr, Eigen::Dynamic, 1>;

inline VecX column(std::span<const Expr> entries) {
  VecX v(static_cast<Eigen::Index>(entries.size()));
  std::copy(entries.begin(), entries.end(), v.data());
  return v;
}
inline std::span<const Expr> entries(const VecX& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }
inline std::span<const Expr> entries(const MatX& m) { return {m.data(), static_cast<std::size_t>(m.size())}; }

}  // namespace pendula
