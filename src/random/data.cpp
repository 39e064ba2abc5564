#include "random/data.hpp"

#include <algorithm>
#include <cmath>

#include "base/epsilon.hpp"
#include "random/special.hpp"

namespace pendula::random {
namespace {

double spread(std::span<const double> sorted) {
  double mean = 0, square = 0, count = 0;
  for (double v : sorted) {
    const double d = v - mean;
    mean += d / ++count;
    square += d * (v - mean);
  }
  return count > 1 ? std::sqrt(square / (count - 1)) : 0;
}

/// A width to draw samples that are all equal: digits of the value remain distinct in seven digits.
double width_of_one(double value) { return std::max(std::fabs(value) * 1e-6, least_size); }

double interquartile(std::span<const double> sorted) {
  return sample_quantile(sorted, 0.75) - sample_quantile(sorted, 0.25);
}

}  // namespace

std::vector<double> sorted_sample(std::span<const double> values) {
  std::vector<double> result;
  for (double v : values)
    if (!std::isnan(v)) result.push_back(v);
  std::sort(result.begin(), result.end());
  return result;
}

double sample_quantile(std::span<const double> sorted, double p) {
  const double h = static_cast<double>(sorted.size() - 1) * p;
  const auto k = static_cast<std::size_t>(h);
  if (k + 1 >= sorted.size()) return sorted.back();
  const double rest = h - static_cast<double>(k);
  return rest == 0 ? sorted[k] : sorted[k] + rest * (sorted[k + 1] - sorted[k]);
}

std::pair<double, double> wilson(long k, long n, double confidence) {
  const double z = normal_quantile(0.5 + confidence / 2), count = static_cast<double>(n);
  const double p = static_cast<double>(k) / count, zz = z * z / count;
  const double centre = p + zz / 2, half = z * std::sqrt(p * (1 - p) / count + zz / (4 * count));
  return {k == 0 ? 0 : (centre - half) / (1 + zz), k == n ? 1 : (centre + half) / (1 + zz)};
}

std::pair<double, double> clopper_pearson(long k, long n, double confidence) {
  const double alpha = 1 - confidence, successes = static_cast<double>(k),
               failures = static_cast<double>(n - k);
  return {k == 0 ? 0 : beta_quantile(successes, failures + 1, alpha / 2),
          k == n ? 1 : beta_quantile(successes + 1, failures, 1 - alpha / 2)};
}

Histogram histogram(std::span<const double> sorted, int bins) {
  const double low = sorted.front(), range = sorted.back() - low;
  if (bins == 0) {
    const double width = 2 * interquartile(sorted) / std::cbrt(static_cast<double>(sorted.size()));
    constexpr double most = 200;  // bars that a plot shows; far outliers ask for more
    bins = range > 0 && width > 0 ? static_cast<int>(std::clamp(std::ceil(range / width), 1.0, most)) : 1;
  }
  Histogram h;
  const double all = range > 0 ? range : width_of_one(low);
  const double first = range > 0 ? low : low - all / 2;
  for (int k = 0; k <= bins; ++k) h.edges.push_back(first + all * k / bins);
  h.counts.assign(bins, 0);
  for (double v : sorted) {
    const auto cell = static_cast<long>((v - first) / all * bins);
    ++h.counts[std::clamp<long>(cell, 0, bins - 1)];
  }
  return h;
}

std::vector<double> kernel_density(std::span<const double> sorted, std::span<const double> x,
                                   double& bandwidth) {
  const auto n = static_cast<double>(sorted.size());
  if (!(bandwidth > 0)) {
    const double s = spread(sorted), iqr = interquartile(sorted) / 1.34;
    bandwidth = 0.9 * (iqr > 0 ? std::min(s, iqr) : s) * std::pow(n, -0.2);
    if (!(bandwidth > 0)) bandwidth = width_of_one(sorted.front());
  }
  constexpr double reach = 8;  // deviations: e⁻³² = 1e-14 of the value at the centre is left out
  std::vector<double> result;
  for (double at : x) {
    const auto first = std::lower_bound(sorted.begin(), sorted.end(), at - reach * bandwidth);
    const auto last = std::upper_bound(first, sorted.end(), at + reach * bandwidth);
    double sum = 0;
    for (auto it = first; it != last; ++it) {
      const double u = (at - *it) / bandwidth;
      sum += std::exp(-u * u / 2);
    }
    result.push_back(sum / (n * bandwidth * std::sqrt(2 * M_PI)));
  }
  return result;
}

double kolmogorov_smirnov(std::span<const double> F) {
  const auto n = static_cast<double>(F.size());
  double d = 0;
  for (std::size_t i = 0; i < F.size(); ++i)
    d = std::max({d, static_cast<double>(i + 1) / n - F[i], F[i] - static_cast<double>(i) / n});
  return d;
}

double kolmogorov_smirnov_p(double d, long n) {
  const double root = std::sqrt(static_cast<double>(n)), x = (root + 0.12 + 0.11 / root) * d;
  if (x < 0.2) return 1;  // to 5e-13, where the series converges slowly
  double sum = 0, sign = 1;
  for (int k = 1; k <= 100; ++k, sign = -sign) sum += sign * std::exp(-2.0 * k * k * x * x);
  return std::clamp(2 * sum, 0.0, 1.0);
}

}  // namespace pendula::random
