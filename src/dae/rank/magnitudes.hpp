// How large are the unknowns? Units of unknowns and equations from the equations alone.
//
// Every sum in an equation says that its terms have comparable size: an equation
// between logarithms of magnitudes, linear where terms are products of powers. Solved in the sense of least
// absolute values, because cancellation and small terms make outliers.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/math.hpp"
#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// Units of unknowns and residuals: the magnitudes for which the terms of every sum have the same size, in
/// the sense of least absolute logarithms. Arguments of sin, exp … have magnitude 1; `known` are the values
/// of parameters and inputs (terms with a factor 0 do not count); `anchors` are values that the user gave,
/// for what the first `equations` of the rows leave open. Multiplying an unknown or an equation by a constant
/// multiplies its unit, and changes nothing else.
struct Magnitudes {
  Vec unknowns, rows;
};
Magnitudes magnitudes(const std::vector<Expr>& rows, std::size_t equations, const std::vector<Expr>& unknowns,
                      const std::unordered_map<Expr, double>& known,
                      const std::vector<std::pair<Expr, double>>& anchors);

/// magnitudes() of the same rows again and again, with other values of `leaves`: the logarithms
/// of all terms are sums of logarithms of these values, and which of them occur depends on
/// little more than which values are 0.
class SizeEquations {
 public:
  using Anchors = std::vector<std::pair<Eigen::Index, double>>;  ///< by the place of the unknown

  /// Those that hold where the leaves have these values.
  SizeEquations(const std::vector<Expr>& rows, std::size_t equations, const std::vector<Expr>& unknowns,
                std::span<const Expr> leaves, std::span<const double> values);
  ~SizeEquations();

  /// Nothing where other terms occur than in the values it was made with. Cost: linear, and five
  /// factorisations of a sparse matrix of the unknowns.
  std::optional<Magnitudes> operator()(std::span<const double> values, const Anchors& anchors);

  struct Parts;

 private:
  std::unique_ptr<Parts> parts_;
};

}  // namespace pendula::dae
