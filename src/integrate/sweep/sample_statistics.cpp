#include "integrate/sweep/sample_statistics.hpp"

#include <algorithm>
#include <cmath>

namespace pendula::integrate {

SampleStatistics statistics_of(const Mat& values) {
  SampleStatistics s;
  double sum = 0, square = 0;
  for (double v : values.reshaped()) {
    if (std::isnan(v)) continue;
    s.min = s.count ? std::min(s.min, v) : v;
    s.max = s.count ? std::max(s.max, v) : v;
    ++s.count;
    sum += v;
  }
  if (s.count == 0) return s;
  s.mean = sum / static_cast<double>(s.count);
  for (double v : values.reshaped())
    if (!std::isnan(v)) square += (v - s.mean) * (v - s.mean);
  s.deviation = s.count > 1 ? std::sqrt(square / static_cast<double>(s.count - 1)) : 0;
  return s;
}

}  // namespace pendula::integrate
