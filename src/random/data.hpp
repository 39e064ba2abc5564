// Sample statistics: quantiles, densities, intervals.
#pragma once

#include <span>
#include <utility>
#include <vector>

namespace pendula::random {

/// Values without those that are NaN, ascending.
std::vector<double> sorted_sample(std::span<const double> values);

/// Quantile of an ascending sample: linear between order statistics, h = (n - 1)p + 1 (type 7 of Hyndman &
/// Fan, Amer. Statist. 50(4), 1996). requires 0 ≤ p ≤ 1, a sample that is not empty
double sample_quantile(std::span<const double> sorted, double p);

/// An interval for a probability from k successes in n trials that contains it with the given confidence.
/// wilson: Wilson, J. Amer. Statist. Assoc. 22, 1927. clopper_pearson: exact,
/// conservative (Biometrika 26, 1934).
std::pair<double, double> wilson(long k, long n, double confidence);
std::pair<double, double> clopper_pearson(long k, long n, double confidence);

/// Counts in equal cells between edges.
struct Histogram {
  std::vector<double> edges;  ///< one more than counts
  std::vector<long> counts;
};
/// bins = 0: width 2 IQR n^{-1/3} (Freedman & Diaconis, 1981), at most 200.
Histogram histogram(std::span<const double> sorted, int bins);

/// Gaussian kernel density at x; bandwidth = 0: 0.9 min(s, IQR/1.34) n^{-1/5} (Silverman, 1986, §3.4.2). Only
/// the sample within eight bandwidths counts.
std::vector<double> kernel_density(std::span<const double> sorted, std::span<const double> x,
                                   double& bandwidth);

/// sup |F_n - F|, given F at the ascending sample.
double kolmogorov_smirnov(std::span<const double> F);
/// P(D > d) for n values: Kolmogorov's series at (√n + 0.12 + 0.11/√n) d (Stephens, J.
/// Roy. Statist. Soc. B 32, 1970).
double kolmogorov_smirnov_p(double d, long n);

}  // namespace pendula::random
