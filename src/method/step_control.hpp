// The constants of step size control that follow from a tableau (Hairer, Nørsett & Wanner, Solving ODEs I,
// 2nd ed., §II.4; docs/derivations.md#step-size-control).
#pragma once

#include <optional>

#include "method/tableau.hpp"

namespace pendula::integrate {

/// Gustafsson's PI controller with the exponents of DOPRI5; without the integral part for orders
/// from 7 on, as in DOP853: with exponents 0.7/k and 0.4/k the step size oscillates at the stability
/// limit and the stiffness test fails.
struct StepRules {
  /// Requires an explicit method with an embedded one.
  explicit StepRules(const Tableau& rk);
  int control_order;        ///< of the error estimate
  double beta, exponent;    ///< dt ← dt · 0.9 · err_old^β / err^exponent
  double slowest, fastest;  ///< between these factors
  /// `fastest` after the first step. A quotient of two estimates, as in DOP853, vanishes by chance more
  /// often than one estimate does; the next step is then `fastest` times as long, and its error, of
  /// order k, fastestᵏ times as large.
  double settled_fastest;
  double stability_limit;  ///< the largest y with |R(-y')| ≤ 1 for all 0 ≤ y' ≤ y
  bool fsal;
  std::optional<int> stiff_stage;  ///< g, a second stage at the end of the step
  double resolution =
      0;  ///< beyond this share of h (x₁′ - x₀′), x₁ - g says that the stages have missed something
};

}  // namespace pendula::integrate
