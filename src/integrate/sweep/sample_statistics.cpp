#include "integrate/sweep/sample_statistics.hpp"

#include <algorithm>
#include <cmath>

namespace pendula::integrate {

SampleStatistics statistics_of(const Sweep& sweep, Expr e, std::optional<double> t) {
  SampleStatistics s;
  double mean = 0, square = 0;
  sweep.each({&e, 1}, t, [&](int, const double* value) {
    const double v = *value;
    if (std::isnan(v)) return;
    s.min = s.count ? std::min(s.min, v) : v;
    s.max = s.count ? std::max(s.max, v) : v;
    ++s.count;
    const double d = v - mean;
    mean += d / static_cast<double>(s.count);
    square += d * (v - mean);
  });
  if (s.count == 0) return s;
  s.mean = mean;
  s.deviation = s.count > 1 ? std::sqrt(square / static_cast<double>(s.count - 1)) : 0;
  return s;
}

}  // namespace pendula::integrate
