// A point at which the derivative array determines the derivatives of all unknowns: where the rows of form
// "array" are chosen.
#pragma once

#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "base/math.hpp"
#include "dae/points/array_points.hpp"
#include "dae/points/derivative_array.hpp"

namespace pendula::dae {

/// F_k, as expressions and with numbers; nothing of a point.
struct ArrayEquations {
  /// Of ∂F_k/∂(x, y): orthogonal decompositions cost O(n³), of 960 ten seconds.
  static constexpr std::size_t most_columns = 400;
  DerivativeArray array;
  std::vector<Expr> columns;            ///< of the array: x, x′ and z, higher derivatives
  std::optional<NumericArray> numeric;  ///< empty where there are too many unknowns
  ArrayEquations(const Model& m, int order);
};
using ArrayEquationsPtr = std::shared_ptr<const ArrayEquations>;

/// A point of F_k = 0, and the Jacobian there, equilibrated or balanced.
struct ArrayPoint {
  ArrayEquationsPtr equations;
  Vec w;
  Mat J;
  std::unordered_map<Expr, double> known;  ///< t, inputs, parameters

  const DerivativeArray& array() const { return equations->array; }
  Eigen::Index states() const { return static_cast<Eigen::Index>(array().states().size()); }
  Eigen::Index first() const { return static_cast<Eigen::Index>(array().first().size()); }
};

/// A point of F_k = 0 that determines x′ and at which the rank of the rows is the largest found. Searched
/// near the given values if there are any.
std::optional<ArrayPoint> regular_point(const Model& m, const ArrayEquationsPtr& equations,
                                        const std::unordered_map<Expr, double>& near);

/// Values of all leaves at a point of F_order = 0 where x′ is determined; empty where none is found.
std::unordered_map<Expr, double> values_at_regular_point(const Model& model, int order);

/// The unknowns of a model of form "array" near a point that gives the unknowns of the original:
/// derivatives order by order, since the rows of highest order are far from linear in all of
/// them. Empty where none are found.
std::unordered_map<Expr, double> derivatives_near(const ModelPtr& array,
                                                  const std::unordered_map<Expr, double>& point);

}  // namespace pendula::dae
