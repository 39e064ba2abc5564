// The derivative arrays of a model in numbers, F_0, F_1 … as far as they have been asked for.
#pragma once

#include <memory>
#include <vector>

#include "dae/points/array_points.hpp"

namespace pendula::dae {

/// A search for continuations uses the same arrays at every point and for every continuation found there.
class NumericArrays {
 public:
  explicit NumericArrays(const Model& model);

  /// F_k; columns: the states of the model, algebraic variables, x′, then the higher derivatives.
  const NumericArray& of_order(int k);
  /// How many nodes the rows of F_k have.
  std::size_t nodes(int k);
  const std::vector<Expr>& states() const { return array_.states(); }  ///< and algebraic variables

 private:
  struct Level {
    std::vector<Expr> rows, columns;
    std::unique_ptr<NumericArray> numeric;  ///< made when it is asked for
  };
  Level& level(int k);

  DerivativeArray array_;
  std::vector<Expr> held_;  ///< the states of the model
  std::vector<Level> levels_;
};

/// Those of the last few models are kept.
std::shared_ptr<NumericArrays> numeric_arrays(const Model& model);

}  // namespace pendula::dae
