// Rise, overshoot, settling: what is read off a curve.
#pragma once

#include <optional>

#include "base/math.hpp"

namespace pendula::lti {

/// Characteristic values of a curve that settles (steps) or rises and falls.
struct CurveFacts {
  double final = 0, peak = 0, peak_time = 0;
  std::optional<double> rise_time, settling_time,
      overshoot;  ///< 10–90 %, within 2 %, in % of the final value
};

/// Of the straight lines through samples of a step response.
CurveFacts curve_facts(const Vec& t, const Vec& y, double final);

}  // namespace pendula::lti
