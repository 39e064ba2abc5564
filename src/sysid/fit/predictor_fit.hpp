// The parameters of a predictor given as an expression, from data.
#pragma once

#include "sysid/model/predictor.hpp"
#include "sysid/noise/likelihood.hpp"

namespace pendula::sysid {

/// Parameters of any predictor by least squares: one linear problem if the predictor is linear in θ, else
/// Gauss–Newton with damping, the gradient carried through the recursion: dŷ = ∂f/∂θ + Σ ∂f/∂ŷ(t-k) dŷ(t-k).
struct PredictorFit {
  Predictor predictor;
  std::vector<std::string> names;
  LeastSquares ls;
  Vec theta, std;
  Mat covariance;
  Criteria quality;
  bool exact = false;
  int iterations = 0;
  Mat iterates;  ///< θ at the start and after each iteration, one per row; no rows where the problem is linear
  Vec losses;    ///< SSE of these
  std::string ending;  ///< of a search that did not converge, in words
  std::vector<std::string> unidentifiable;
  Vec predictions, residuals;  ///< at the rows used
  Index first = 0;             ///< rows left out at the start of each experiment
  std::string noise;           ///< maximum likelihood: the density in words
  double log_likelihood = 0;
};
/// With a density (not uniform): maximum likelihood; requires a linear predictor.
PredictorFit fit(const Predictor& p, const IdData& d, InitialCondition start, const Vec& theta0,
                 const Density* density = nullptr);
/// y - offset = Φθ of a linear predictor. Throws Error if it is not linear.
Regression regression(const Predictor& p, const IdData& d, InitialCondition start);
std::string describe(const PredictorFit& f);

}  // namespace pendula::sysid
