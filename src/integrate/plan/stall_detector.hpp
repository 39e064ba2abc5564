// Detects a run that makes no progress near a singularity: an explicit method would follow the singular
// points in ever smaller steps.
#pragma once

#include <limits>

#include "integrate/solve/stats.hpp"

namespace pendula::integrate {

class StallDetector {
 public:
  static constexpr long every = 2000;  ///< steps between two checks: a check costs as much as a few steps

  /// Once in 2000 steps: true if meanwhile t has moved by less than 10⁻⁶ of the interval, or more than a
  /// third of the attempts were rejected.
  bool is_stalled(double t, const Stats& stats, double interval) {
    if (stats.steps < steps_ + every) return false;
    constexpr double little = 1e-6;  // at this rate the interval takes 2·10⁹ steps
    const bool still = t - t_ < little * interval;
    const bool rejected = stats.rejected - rejected_ > every / 2;
    steps_ = stats.steps;
    rejected_ = stats.rejected;
    t_ = t;
    return still || rejected;
  }

 private:
  long steps_ = 0, rejected_ = 0;
  double t_ = -std::numeric_limits<double>::infinity();
};

}  // namespace pendula::integrate
