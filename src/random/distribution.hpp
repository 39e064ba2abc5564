// Distributions as values: what a parameter or an initial value may be.
//
// Numbers are drawn by inverse transform, x = F⁻¹(u): one uniform number makes one value, so
// that every design (Latin hypercube, Sobol', …) works with every distribution, and
// neighbours in u stay neighbours in x.
//
// philox.hpp and sobol.hpp make the u, design.hpp arranges them, sample_space.hpp makes the runs of a sweep
// of them; special.hpp: distribution functions; data.hpp: statistics of samples.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/math.hpp"

namespace pendula::random {

class Distribution {
 public:
  enum class Kind { normal, lognormal, uniform, triangular, beta, exponential, discrete, empirical };

  virtual ~Distribution() = default;
  virtual Kind kind() const = 0;
  /// x with F(x) = u, for 0 < u < 1; discrete: the least x with F(x) ≥ u.
  virtual double quantile(double u) const = 0;
  virtual double cdf(double x) const = 0;
  virtual double mean() const = 0;
  virtual double deviation() const = 0;
  /// The call that makes it: "normal(1, 0.1)".
  virtual std::string code() const = 0;
  /// The parameters of the call, in their order.
  virtual std::vector<double> parameters() const = 0;
};
using DistributionPtr = std::shared_ptr<const Distribution>;

// ── each throws Error naming the parameter that is wrong ──

/// Mean and standard deviation > 0.
DistributionPtr normal(double mean, double sigma);
/// Mean and standard deviation of ln x.
DistributionPtr lognormal(double mu, double sigma);
DistributionPtr uniform(double low, double high);
DistributionPtr triangular(double low, double mode, double high);
/// Beta(a, b) on [low, high].
DistributionPtr beta(double a, double b, double low, double high);
/// Density λ e^{-λx} for x ≥ 0.
DistributionPtr exponential(double rate);
/// Values with weights that need not sum to 1 (empty: equal ones).
DistributionPtr discrete(std::vector<double> values, std::vector<double> weights);
/// The empirical distribution of data: every datum is as likely as the others.
DistributionPtr empirical(std::vector<double> data);

/// Several normal numbers with a covariance: x = m + L z, S = L Lᵀ with z standard normal.
///
/// shapes    m ∈ ℝⁿ, S ∈ ℝⁿˣⁿ, symmetric, positive semidefinite (to rounding)
/// throws    Error where S is not that, with the pair of entries or the negative eigenvalue
class JointNormal {
 public:
  JointNormal(Vec mean, Mat covariance);
  int size() const { return static_cast<int>(mean_.size()); }
  const Vec& mean() const { return mean_; }
  const Mat& covariance() const { return covariance_; }
  /// From standard normal numbers.
  double component(int i, const double* z) const;

 private:
  Vec mean_;
  Mat covariance_, factor_;  ///< L, lower triangular
};
using JointNormalPtr = std::shared_ptr<const JointNormal>;

}  // namespace pendula::random
