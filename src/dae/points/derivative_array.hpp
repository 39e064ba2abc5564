// F_k(t, x, y) = (F, dF/dt, …, dᵏF/dtᵏ), the equations of a DAE and their derivatives as expressions; what it
// is for is said in index/array_index.hpp.
#pragma once

#include <vector>

#include "dae/model/model.hpp"
#include "expr/graph/taylor.hpp"

namespace pendula::dae {

/// F_k of a list of residuals, extended one derivative at a time.
class DerivativeArray {
 public:
  DerivativeArray(std::vector<Expr> residuals, const std::vector<Variable>& variables);

  /// Appends the next derivative of every residual.
  void extend();
  int order() const { return order_; }
  /// All rows: residual i differentiated k times is row k·m + i.
  const std::vector<Expr>& rows() const { return rows_; }
  std::size_t equations() const { return equations_; }
  /// x, then x′, then the higher derivatives that occur.
  const std::vector<Expr>& states() const { return states_; }
  const std::vector<Expr>& first() const { return first_; }
  const std::vector<Expr>& higher() const { return higher_; }
  std::vector<Expr> columns() const;
  /// ∂rows/∂columns by rows; what was found before an extension is kept.
  const std::vector<Entry>& jacobian() const;

 private:
  mutable std::vector<Entry> jacobian_;
  mutable std::size_t in_jacobian_ = 0;  ///< rows
  int order_ = 0;
  std::size_t equations_;
  TaylorSeries series_;
  std::vector<Expr> rows_, states_, first_, higher_;
};

}  // namespace pendula::dae
