// Gustafsson's predictive step size control of implicit one-step methods: the trend of errors predicts the
// next one (Gustafsson, ACM TOMS 20(4), 1994; Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.8;
// docs/derivations.md#step-size-control).
#pragma once

#include <algorithm>

#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

struct PredictiveController {
  static constexpr double safety = 0.9;        ///< Hairer & Wanner, §IV.8
  static constexpr double least_error = 1e-2;  ///< that a prediction is based on, as in RADAU5

  bool first = true;         ///< no step has been accepted since the start
  bool repeated = false;     ///< the last attempt was rejected
  double dt = 0, error = 0;  ///< of the last accepted step

  void start() { *this = {}; }
  /// dt / (next dt) after a step with this error, of an estimate of this order; between `least` and
  /// `most`. factor: a safety factor.
  double quotient(double step, double norm, int order, double factor, double least, double most) const {
    const double now = std::clamp(root(norm, order) / factor, least, most);
    if (first) return now;
    const double predicted = dt / step * root(norm * norm / error, order) / safety;
    return std::max(now, std::clamp(predicted, least, most));
  }
  /// The next step: not longer than this one after a rejection.
  double propose(double step, double quotient) const {
    return repeated ? std::min(step, step / quotient) : step / quotient;
  }
  void accept(double step, double norm) {
    dt = step;
    error = std::max(least_error, norm);
    first = repeated = false;
  }
};

}  // namespace pendula::integrate
