// Maximum likelihood for prediction-error models: min Σ -ln f(ε(t, θ)) from the least-squares estimate, by
// weighted Gauss–Newton steps with the weights (-ln f)′(ε)/ε (iteratively reweighted least squares; Huber,
// Robust Statistics, 1981, §7.8).
#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/search/least_squares.hpp"
#include "base/text.hpp"
#include "sysid/fit/pem.hpp"
#include "sysid/noise/likelihood.hpp"

namespace pendula::sysid {
namespace {

/// A model of -ln L with weights w = (-ln f)′(ε)/ε: gradient Jᵀ W ε, curvature approximated by JᵀWJ. The
/// weight of a density with a kink is infinite at 0, so errors below 1e-9 of their root mean square are
/// replaced by that: the factors √w of the rows then differ by some 3e4, which costs five digits at most.
QuadraticModel weighted_model(const PredictionErrors& at, const NegativeLogarithm& f) {
  const double floor = 1e-9 * std::sqrt(at.e.squaredNorm() / static_cast<double>(at.e.size()));
  double value = 0;
  Vec w(at.e.size());
  for (Index t = 0; t < w.size(); ++t) {
    value += f(at.e[t])[0];
    const double e = std::copysign(std::max(std::abs(at.e[t]), floor), at.e[t]);
    w[t] = std::sqrt(std::max(0.0, f(e)[1] / e));
  }
  QuadraticModel m = gauss_newton_model(w.asDiagonal() * at.J, w.cwiseProduct(at.e));
  m.value = value;
  return m;
}

}  // namespace

PolyModel pem(const IdData& d, Index output, const Orders& orders, const std::string& kind,
              const PemOptions& options, const Density& density) {
  if (density.kind == Density::Kind::uniform || density.kind == Density::Kind::exponential)
    throw Error(text(
        "with this noise the estimate is a set of parameters or a corner of it, computed only for models that are "
        "linear in θ: arx, fir, lsq, p:fit of a linear predictor"));
  if (const std::string gaps = missing_text(d); !gaps.empty())
    throw Error(text(gaps, "; a density of the noise needs every sample: d:fill(), or d:slice(…)"));
  PolyModel m = pem(d, output, orders, kind, options);
  if (m.identifiability.rank < m.theta.size() || m.exact) return m;
  const NegativeLogarithm f = negative_logarithm(density);
  const auto errors = [&](const Vec& theta) {
    return prediction_errors(d, output, m.orders, theta, options.start, true);
  };
  const auto minus_log_likelihood = [&](Vec& theta) -> std::optional<QuadraticModel> {
    if (!admissible(polynomials_of(theta, m.orders))) return {};
    return weighted_model(errors(theta), f);
  };
  const auto first = minus_log_likelihood(m.theta);
  if (!first || !std::isfinite(first->value))
    throw Failure("the density is zero or undefined at an error of the least-squares estimate");
  double value = first->value;
  int steps = 0;
  if (density.kind != Density::Kind::gaussian) {
    MinimiserOptions search;
    search.iterations = 500;  // a cap: weighted steps converge linearly only
    const Minimum best = minimise(minus_log_likelihood, m.theta, search);
    m.theta = best.theta;
    value = best.value;
    steps = best.iterations;
  }
  const PredictionErrors at = errors(m.theta);
  const auto N = static_cast<double>(at.rows);
  LikelihoodFit fit;
  fit.theta = m.theta;
  double information = 0;  // of one sample, relative to the scale
  if (density.kind == Density::Kind::gaussian) {
    fit.scale = density.scale.value_or(std::sqrt(at.e.squaredNorm() / N));
    information = 1 / (fit.scale * fit.scale);
  } else if (density.kind == Density::Kind::laplace) {
    fit.scale = density.scale.value_or(at.e.lpNorm<1>() / N);
    information = 1 / (fit.scale * fit.scale);
  } else
    for (const double e : at.e) information += std::pow(f(e)[1], 2) / N;
  if (density.kind == Density::Kind::gaussian)
    m.log_likelihood =
        -N * std::log(fit.scale * std::sqrt(2 * M_PI)) - at.e.squaredNorm() / (2 * fit.scale * fit.scale);
  else if (density.kind == Density::Kind::laplace)
    m.log_likelihood = -N * std::log(2 * fit.scale) - at.e.lpNorm<1>() / fit.scale;
  else
    m.log_likelihood = -value;
  m.covariance =
      Mat(Mat(at.J.transpose() * at.J).ldlt().solve(Mat(Mat::Identity(m.theta.size(), m.theta.size())))) /
      information;
  m.std = m.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  m.p = polynomials_of(m.theta, m.orders);
  m.noise = described(density, fit);
  m.search.method =
      text("maximum likelihood (", std::max(steps, 1), " weighted Gauss–Newton step", steps > 1 ? "s)" : ")");
  m.quality = criteria(at.e.squaredNorm(), at.rows, m.theta.size(), compared_variation(d, m));
  m.simulation.percent = simulation_fit(m, d, seed_of_estimation(m));
  return m;
}

}  // namespace pendula::sysid
