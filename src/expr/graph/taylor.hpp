// Time derivatives of high order by Taylor arithmetic: expressions for the coefficients of a power series
// instead of derivatives written out, which grow exponentially with the order.
//
//   e(t + τ) = Σ e_k τᵏ,   (a b)_k = Σ a_i b_{k-i},   r = φ(a):  k r_k = Σ i a_i φ′(a)_{k-i}  (i = 1 … k)
//
// The coefficients of all operations are nodes of the graph, shared by those of higher order: O(k²) nodes for
// every operation. See docs/derivations.md#taylor.
#pragma once

#include <unordered_map>
#include <vector>

#include "expr/graph/derivative.hpp"

namespace pendula {

class TaylorSeries {
 public:
  /// rates: what stands for a derivative x′ (its values may not contain keys); x is
  /// then followed along x′ = f.
  explicit TaylorSeries(Substitution rates = {}) : rates_(std::move(rates)) {}

  /// d^k e/dt^k with every x′ of `rates` put in. Requires k ≥ 0. Cost: O(k²) nodes per
  /// operation of e and of the rates.
  Expr derivative(Expr e, int k);

 private:
  Expr coefficient(Expr e, int k);
  Expr leaf_coefficient(Expr leaf, int k);
  Expr operation_coefficient(Expr e, int k);

  Substitution rates_;
  std::unordered_map<Expr, std::vector<Expr>> series_;
};

/// Is d^k e/dt^k better taken from the series than by differentiating `before`, the derivative
/// of order k - 1? Where that is long and of high order. Never for components of linear
/// systems, whose series have no rule.
bool prefers_series(Expr e, Expr before, int k);

}  // namespace pendula
