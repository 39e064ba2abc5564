// The order of a Runge-Kutta method, decided from its coefficients (docs/derivations.md#order-conditions).
//
// Two methods, both exact up to the digits the coefficients are known to:
//   simplifying assumptions   B(p): Σ bᵢcᵢ^(q-1) = 1/q          (q ≤ p)
//                             C(η): Σⱼ aᵢⱼcⱼ^(q-1) = cᵢ^q/q       (q ≤ η)
//                             D(ζ): Σᵢ bᵢcᵢ^(q-1)aᵢⱼ = bⱼ(1 - cⱼ^q)/q  (q ≤ ζ)
//     B(p), C(η), D(ζ) with p ≤ η + ζ + 1 and p ≤ 2η + 2 give order p: this settles collocation
//     methods of any size. Butcher, Math. Comp. 18, 1964; Hairer, Nørsett & Wanner, Solving
//     ODEs I, 2nd ed., §II.7, Thm 7.4.
//   rooted trees              order p ⇔ Σ bᵢφᵢ(τ) = 1/γ(τ) for every tree τ with |τ| ≤ p  (§II.2, Thm 2.13);
//     bushy trees alone are quadrature: only the others see the nonlinear terms.
#pragma once

#include "method/exact/precise.hpp"
#include "method/trees.hpp"

namespace pendula::integrate {

/// The coefficients to many digits. `unit`: relative size of a sum of products that counts as zero
/// (2^(-bits/2) for exact coefficients, a few rounding errors for coefficients that were given as doubles or
/// long decimals).
struct Coefficients {
  RealMatrix A;
  RealVector b, c;
  RealVector bhat, bhat2;  ///< empty if there is no (second) embedded method
  mp_bitcnt_t bits = 0;
  double unit = 0;

  int stages() const { return A.size(); }
};

/// Orders above this that the simplifying assumptions do not settle are not searched
/// for (4766 trees at order 12).
inline constexpr int largest_tree_order = 12;

/// The order of the method with weights b (rk.b or rk.bhat). Cost: O(s³) for the assumptions, s² per tree.
int algebraic_order(const Coefficients& rk, const RealVector& b);

/// The weights Σ bᵢφᵢ(τ) of a tableau, tree by tree. Cost: s² multiplications per tree, once.
class ElementaryWeights {
 public:
  explicit ElementaryWeights(const Coefficients& rk) : rk_(rk) {}

  /// φ(τ) and, by component, the scale of its rounding.
  const RealVector& phi(int tree);
  Real weight(int tree, const RealVector& b);
  /// Σ bᵢφᵢ(τ) = target up to rounding.
  bool equals(int tree, const RealVector& b, const Real& target);
  /// Σ bᵢφᵢ(τ) = 1/γ(τ) for every tree of this order.
  bool order_holds(int order, const RealVector& b);

 private:
  struct Entry {
    RealVector phi, size;     ///< φ and ∏ Σ|a||φ|, the scale of its rounding
    RealVector stage, scale;  ///< A φ and its scale: what a parent multiplies
  };
  const Entry& entry(int tree);

  const Coefficients& rk_;
  std::vector<Entry> entries_;
};

/// The order of a dense output: the largest q ≤ limit with Σᵢ bᵢ(θ)φᵢ(τ) = θ^|τ|/γ(τ) for |τ| ≤ q, where
/// bᵢ(θ) = Σₖ columns[k-1][i] θᵏ.
int continuous_order(const Coefficients& rk, const std::vector<RealVector>& columns, int limit);

/// The largest p with B(p), η with C(η), ζ with D(ζ).
struct SimplifyingAssumptions {
  int B = 0, C = 0, D = 0;
};
SimplifyingAssumptions simplifying_assumptions(const Coefficients& rk, const RealVector& b);

/// The largest q with C(q) and B(q).
int stage_order(const Coefficients& rk);

/// C(s) with distinct nodes: the x̂ of HNW §II.7 is a polynomial and the method is its collocation.
bool satisfies_collocation(const Coefficients& rk);

/// Equal up to the coefficients' own accuracy.
bool equal(const Real& a, const Real& b, const Coefficients& rk);

}  // namespace pendula::integrate
