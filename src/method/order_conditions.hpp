// Order conditions with their trees, values and residuals: the proof of a claimed order, to be printed.
#pragma once

#include "method/exact/surd.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

/// A, b, c as exact numbers, if all of them lie in one field ℚ(√d).
struct ExactCoefficients {
  int stages = 0;
  std::vector<Surd> A, b, c;
  std::optional<std::vector<Surd>> bhat;
  const Surd& a(int i, int j) const { return A[i * stages + j]; }
};
std::optional<ExactCoefficients> exact_coefficients(const Tableau& rk);

struct OrderCondition {
  int tree = 0;         ///< number in rooted_trees
  int order = 0;        ///< |τ|
  std::string name;     ///< "[τ[τ]]"
  std::string formula;  ///< "bᵀ(c·Ac)"
  mpq_class target;     ///< 1/γ(τ)
  double value = 0, residual = 0;
  std::optional<Surd> exact_value, exact_residual;
  bool met = false;
};

/// The conditions of all trees with at most `order` vertices, 1 ≤ order ≤ 12; with bhat in place of b if
/// `embedded`. Cost: s² multiplications per tree.
std::vector<OrderCondition> order_conditions(const Tableau& rk, int order, bool embedded = false);

/// Σ over trees of order p + 1 of (residual/σ(τ))², square-rooted: how large the leading error is.
double principal_error_norm(const Tableau& rk);

}  // namespace pendula::integrate
