// Mean and spread of a value over the runs of a sweep.
#pragma once

#include "base/math.hpp"

namespace pendula::integrate {

struct SampleStatistics {
  double mean = NAN, min = NAN, max = NAN;
  double deviation = NAN;  ///< the square root of Σ (v - mean)²/(n - 1); 0 for one value
  long count = 0;          ///< n, the values that are not nan
};

/// Of all entries that are not nan (runs that failed).
SampleStatistics statistics_of(const Mat& values);

}  // namespace pendula::integrate
