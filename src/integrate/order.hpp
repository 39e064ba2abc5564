// The order of a Runge-Kutta method, decided from its coefficients.
//
// Two roads, both exact up to the digits the coefficients are known to:
//   simplifying assumptions   B(p): Σ bᵢcᵢ^(q-1) = 1/q          (q ≤ p)
//                             C(η): Σⱼ aᵢⱼcⱼ^(q-1) = cᵢ^q/q       (q ≤ η)
//                             D(ζ): Σᵢ bᵢcᵢ^(q-1)aᵢⱼ = bⱼ(1 - cⱼ^q)/q  (q ≤ ζ)
//     B(p), C(η), D(ζ) with p ≤ η + ζ + 1 and p ≤ 2η + 2 give order p: this settles collocation methods of
//     any size. Butcher, Math. Comp. 18, 1964; Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.7,
//     Thm 7.4.
//   rooted trees              order p ⇔ Σ bᵢφᵢ(τ) = 1/γ(τ) for every tree τ with |τ| ≤ p  (§II.2, Thm 2.13);
//     bushy trees alone are quadrature: only the others see the nonlinear terms.
#pragma once

#include "integrate/precise.hpp"

namespace pendula::integrate {

/// The coefficients to many digits. `unit`: relative size of a sum of products that counts as zero
/// (2^(-bits/2) for exact coefficients, a few rounding errors for coefficients that were given as doubles or
/// long decimals).
struct Coefficients {
  RealMatrix A;
  RealVector b, c;
  RealVector bhat;  ///< empty if there is no embedded method
  mp_bitcnt_t bits = 0;
  double unit = 0;

  int stages() const { return A.size(); }
};

/// Orders above this that the simplifying assumptions do not settle are not searched for (4766 trees at order
/// 12).
inline constexpr int largest_tree_order = 12;

/// The order of the method with weights b (rk.b or rk.bhat). Cost: O(s³) for the assumptions, s² per tree.
int algebraic_order(const Coefficients& rk, const RealVector& b);

/// The largest q with C(q) and B(q).
int stage_order(const Coefficients& rk);

/// C(s) with distinct nodes: x̂ of (69) is a polynomial and the method is its collocation.
bool satisfies_collocation(const Coefficients& rk);

/// Equal up to the coefficients' own accuracy.
bool equal(const Real& a, const Real& b, const Coefficients& rk);

}  // namespace pendula::integrate
