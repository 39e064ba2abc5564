// What step size control makes of a tableau: orders and limits (Hairer, Nørsett & Wanner, Solving ODEs I, 2nd
// ed., §II.4).
#pragma once

#include "method/tableau.hpp"

namespace pendula::integrate {

/// Gustafsson's PI controller as DOPRI5 has it, without the integral part for high orders, as in DOP853: with
/// it (exponents 0.7/k and 0.4/k) steps on the edge of stability swing so that stiffness goes unnoticed.
struct ExplicitRules {
  /// Requires an explicit method with an embedded one.
  explicit ExplicitRules(const Tableau& rk);
  int control_order;        ///< of the error estimate
  double beta, exponent;    ///< dt ← dt · 0.9 · err_old^β / err^exponent
  double slowest, fastest;  ///< between these factors
  double stability_limit;   ///< the largest y with |R(-y')| ≤ 1 for all 0 ≤ y' ≤ y
  bool fsal;
  int stiff_stage = -1;  ///< a second stage at the end of the step, or -1
};

}  // namespace pendula::integrate
