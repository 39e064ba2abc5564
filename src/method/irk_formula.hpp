// A fully implicit Runge-Kutta method with everything that is needed to solve it by simplified Newton
// iterations: A⁻¹ in real block-diagonal form, the error estimate, the collocation polynomial.
#pragma once

#include <complex>
#include <memory>
#include <vector>

#include "method/tableau.hpp"

namespace pendula::integrate {

/// Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.8: with Zᵢ = Yᵢ - y₀ and W = A⁻¹ the stage derivatives are
/// (W Z)ᵢ/h, and T⁻¹ W T = diag(γ, [α₁ β₁; -β₁ α₁], …).
struct IrkFormula {
  explicit IrkFormula(TableauPtr tableau);

  TableauPtr tableau;
  int s;
  std::vector<double> c;
  Mat W, T, T_inverse;
  bool has_real;                            ///< γ is an eigenvalue (s odd)
  double gamma;                             ///< of the error filter too
  std::vector<std::complex<double>> pairs;  ///< α + iβ
  Vec error;  ///< e: -F(t₀, y₀, -Σ eᵢ Zᵢ/h) measures the difference to a method of order s
  Vec end;    ///< y₁ = y₀ + Σ dᵢ Zᵢ; the last unit vector for stiffly accurate methods
  bool stiffly_accurate;
  std::vector<double> nodes, barycentric;  ///< 0, c₁ … c_s and their weights
  static constexpr int most_last_degrees = 4;
  Mat last_degrees;  ///< times Z: the coefficients of the collocation polynomial of P_s, P_s-1 … (Legendre)

  /// l[j], j = 0 … s: the Lagrange polynomials on the nodes at θ (and their derivatives).
  void lagrange(double theta, double* l) const;
  void lagrange_slopes(double theta, double* slopes) const;
  /// The same of the polynomial of degree q, 1 … s, that has the value at c_s and is closest to the
  /// others (least squares): beyond the nodes it multiplies errors of the values by less than the
  /// one through all of them, q = s.
  /// requires  q = s or a stiffly accurate method
  void closest(double theta, int q, double* l) const;

 private:
  void find_nodes();
  void orthogonalise();
  void find_last_degrees();
  Mat Q_, R_;  ///< (cᵢ - 1)ᵏ, i = 0 … s - 1, k = 1 … s: orthogonal columns and what makes powers of them
};

/// Radau IIA with s stages, made once.
std::shared_ptr<const IrkFormula> radau_formula(int s);

}  // namespace pendula::integrate
