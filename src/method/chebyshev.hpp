// Explicit Runge-Kutta methods with many stages whose stability region is long along the negative real axis:
// docs/derivations.md#chebyshev.
#pragma once

#include <vector>

namespace pendula::integrate {

/// Runge-Kutta-Chebyshev of order 2 with s ≥ 2 stages, damped: stable on [-β, 0], β = 2/3
/// (s² - 1)(1 - 2ε/15), ε = 2/13. Y₀ = x, Y₁ = Y₀ + μ̃₁ h F₀,
///   Yⱼ = (1 - μⱼ - νⱼ) Y₀ + μⱼ Yⱼ₋₁ + νⱼ Yⱼ₋₂ + h (μ̃ⱼ Fⱼ₋₁ + γ̃ⱼ F₀),   j = 2 … s,
/// and x₁ = Yₛ. Sommeijer, Shampine & Verwer, RKC: An explicit solver for parabolic PDEs, J. Comput. Appl.
/// Math. 88, 1998, §2; van der Houwen & Sommeijer, Z. Angew. Math. Mech. 60, 1980.
struct Chebyshev {
  explicit Chebyshev(int stages);

  struct Stage {
    double mu = 0, nu = 0, slope = 0, first_slope = 0;  ///< μ, ν, μ̃, γ̃
    double c = 0;                                       ///< of the time at which Fⱼ is evaluated
  };
  int stages;
  std::vector<Stage> stage;  ///< 0 … s

  /// The stability polynomial.
  double R(double z) const;
  static double stability_limit(int stages);
  /// The fewest stages whose stability region reaches -z.
  static int stages_for(double z);
};

}  // namespace pendula::integrate
