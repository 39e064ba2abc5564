// Mean and spread of a value over the runs of a sweep.
#pragma once

#include <optional>

#include "integrate/sweep/sweep.hpp"

namespace pendula::integrate {

struct SampleStatistics {
  double mean = NAN, min = NAN, max = NAN;
  double deviation = NAN;  ///< the square root of Σ (v - mean)²/(n - 1); 0 for one value
  long count = 0;          ///< n, the values that are not nan
};

/// Of all values that are not nan, one run after another: nothing is kept (Welford's recursion).
SampleStatistics statistics_of(const Sweep& sweep, Expr e, std::optional<double> t);

}  // namespace pendula::integrate
