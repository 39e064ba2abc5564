// The stability function of a one-step method and what follows from it.
//
//     x′ = λx, z = λΔt:   xₖ₊₁ = R(z) xₖ,   R(z) = P(z)/Q(z) = det(I - zA + z𝟙bᵀ) / det(I - zA)
//
// Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.2–IV.5 and §IV.12. P and Q are exact where the coefficients
// are fractions or lie in one ℚ(√d), and where their values can only be fractions (Padé approximations of
// collocation methods); else they hold as many digits as the coefficients. Verdicts follow from P and Q by
// Sturm and Routh-Hurwitz, without tolerance. docs/derivations.md#stability-functions.
#pragma once

#include <complex>
#include <optional>
#include <string>

#include "method/exact/polynomial.hpp"
#include "method/rosenbrock.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

class Stability {
 public:
  explicit Stability(const Tableau& rk);
  explicit Stability(const Rosenbrock& method);  ///< the same R with αᵢⱼ + γᵢⱼ for A

  const Polynomial& P() const { return P_; }
  const Polynomial& Q() const { return Q_; }  ///< Q(0) = 1
  bool is_exact() const { return exact_; }
  /// P and Q as expressions in the leaf z.
  Expr numerator(Expr z) const;
  Expr denominator(Expr z) const;
  std::complex<double> operator()(std::complex<double> z) const;

  /// x < 0: |R| ≤ 1 on [x, 0] and no further; -∞ if on the whole negative axis.
  double real_limit() const { return real_; }
  /// y ≥ 0: |R(iη)| ≤ 1 for 0 ≤ η ≤ y and no farther; ∞ if on the whole axis.
  double imaginary_limit() const { return imaginary_; }
  double at_infinity() const;  ///< R(∞), ±∞ if |R| grows
  bool is_a_stable() const { return a_stable_; }
  bool is_l_stable() const { return a_stable_ && degree(P_) < degree(Q_); }
  /// α in degrees: |R| ≤ 1 where |arg(-z)| ≤ α; 90 if A-stable, 0 if no sector is stable.
  double alpha_degrees() const { return alpha_; }
  /// C in R(z) - e^z = -C z^(q+1) + …, and q.
  int order() const { return order_; }
  Surd error_constant() const { return error_constant_; }

  /// "(1 + z/3)/(1 - 2z/3 + z²/6)"
  std::string formula() const;
  /// The curves |R(z)| = 1, closed polygons one after another with a NaN between them; `angles` points per
  /// zero of P - e^{iφ}Q.
  std::vector<std::complex<double>> boundary(int angles) const;

 private:
  void finish(int order);
  double sector() const;
  Polynomial P_, Q_;
  bool exact_ = false, a_stable_ = false;
  double tolerance_ = 0, real_ = 0, imaginary_ = 0, alpha_ = 0;
  int order_ = 0;
  Surd error_constant_;
};

/// bᵢ ≥ 0 and (bᵢaᵢⱼ + bⱼaⱼᵢ - bᵢbⱼ) positive semidefinite (ibid., §IV.12, Def. 12.5).
bool is_algebraically_stable(const Tableau& rk);

/// The orders to expect on DAEs in Hessenberg form, solved as they stand; 0: no convergence in
/// general. Index 1: §VI.1, Thm 1.1; index 2: §VII.4, Table 4.1; index 3: Jay, BIT 33, 1993.
struct DaeOrders {
  int x1 = 0, z1 = 0;          ///< index 1, z from the stages; with z re-solved at the mesh points both are p
  int x2 = 0, z2 = 0;          ///< index 2
  int x3 = 0, v3 = 0, z3 = 0;  ///< index 3: positions, velocities, multipliers
};
/// Nothing where the method cannot be applied.
std::optional<DaeOrders> dae_orders(const Tableau& rk, const Stability& stability);

}  // namespace pendula::integrate
