// Regularised least squares for impulse responses: a prior that they are smooth and decay (Pillonetto & De
// Nicolao, Automatica 46(1), 2010; Chen, Ohlsson & Ljung, Automatica 48(8), 2012), whose hyperparameters
// maximise the marginal likelihood (empirical Bayes), computed from the triangular factor of [Φ y] (Chen &
// Ljung, Automatica 49(7), 2013).
//
//   θ ~ N(0, σ² P),  P = blockdiag over groups of κ K(λ, ρ),  y | θ ~ N(Φθ, σ² I)
//   TC: K_ij = λ^max(i,j)          DC: K_ij = λ^((i+j)/2) ρ^|i-j|
#pragma once

#include <string>
#include <vector>

#include "base/math.hpp"

namespace pendula::sysid {

using Eigen::Index;

enum class Kernel { none, tc, dc };
/// "TC", "DC". Throws Error.
Kernel kernel_named(const std::string& name);

struct KernelGroup {
  double size = 1, decay = 0.9, correlation = 0.95;  ///< κ, λ, ρ; the search has its own starts
};
struct RegularisedFit {
  Vec theta;
  Mat covariance;  ///< of the posterior, σ̂² times the inverse information
  std::vector<KernelGroup> groups;
  double sigma2 = 0, sse = 0, log_likelihood = 0;
  double effective = 0;  ///< trace of the smoother: how many parameters the data determine
};
/// R: triangular factor of [Φ y] of `rows` rows; sizes: how many columns each group has. Fewer rows than
/// columns are allowed. Cost: some hundred Cholesky factorisations of that size.
/// throws  Failure where y is zero or nothing is known of it
RegularisedFit regularised(const Mat& R, Index rows, const std::vector<Index>& sizes, Kernel kernel);

}  // namespace pendula::sysid
