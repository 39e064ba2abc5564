// Maximum likelihood for the linear regression y = Φθ + e with independent e of a given density:
// max Π f(y_t - φ_tᵀθ) (Ljung §7.4; docs/derivations.md#densities).
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "expr/graph/graph.hpp"
#include "sysid/noise/polytope.hpp"
#include "sysid/regression/least_squares.hpp"

namespace pendula::sysid {

struct Density {
  enum class Kind { gaussian, uniform, laplace, exponential, user } kind = Kind::gaussian;
  double low = 0, high = 0;     ///< uniform: f = 1/(high - low) on [low, high]
  std::optional<double> scale;  ///< σ, b or 1/λ; nothing: estimated
  Expr error, pdf;              ///< user: f as an expression of the symbol `error`
};
std::string describe(const Density& f);
/// ln f, products, powers and exponentials taken apart where their factors are positive by their form.
Expr log_density(Expr f);

/// -ln f(e) and its slope; of Gaussian and Laplace noise up to scale and constant.
using NegativeLogarithm = std::function<std::array<double, 2>(double)>;
NegativeLogarithm negative_logarithm(const Density& f);

/// A regression as estimators see it; sample[i]: number of the sample (from 1) that row i explains.
struct Regression {
  Mat Phi;
  Vec y;
  std::vector<std::string> names;
  std::vector<Index> sample;
};

/// One maximum-likelihood estimate. gaussian: least squares, cov = σ²(ΦᵀΦ)⁻¹. laplace, b: least
/// absolute deviations, asymptotic cov = b²(ΦᵀΦ)⁻¹ (Fisher information 1/b² per sample).
/// exponential, e ≥ 0: the linear program min Σ e; the estimate sits in a corner and converges like
/// 1/N, so that no standard deviation is given. user: damped Newton from the least-squares estimate;
/// cov = the inverse Hessian of -ln L.
struct LikelihoodFit {
  Vec theta;
  Mat covariance;    ///< empty: none
  double scale = 0;  ///< σ, b, or mean of e
  double log_likelihood = 0;
  int iterations = 0;
  std::vector<Index> corner;  ///< exponential: samples with e = 0
};
/// Requires full column rank. Throws Failure when there is no maximum, Error naming the rows of density zero.
LikelihoodFit maximise(const Regression& r, const Density& f);

/// The density in words with what was estimated of it: "Laplace noise: b = mean |e| = 0.2".
std::string described(const Density& f, const LikelihoodFit& fit);

/// Uniform noise: the set on which the likelihood is (high - low)^-N.
struct ParameterSet {
  Regression regression;
  FeasibleSet strips;
  double low = 0, high = 0;
  bool feasible = false, bounded = false;
  std::vector<std::string> free;  ///< unbounded directions in words
  Mat null_space;
  Polytope polytope;  ///< bounded and feasible
  Mat box;            ///< d×2
  Vec center;         ///< Chebyshev centre; empty: θ of the smallest bound
  double radius = 0;
  SmallestBound smallest;  ///< of |e - (low + high)/2|; computed when empty
};
ParameterSet parameter_set(Regression r, double low, double high);
std::string describe(const ParameterSet& s);
/// low ≤ y_t - φ_tᵀθ ≤ high for all t, up to rounding; the first row that fails.
std::optional<Index> violated(const ParameterSet& s, const Vec& theta);

}  // namespace pendula::sysid
