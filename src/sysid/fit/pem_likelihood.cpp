// Maximum likelihood for prediction-error models: min Σ -ln f(ε(t, θ)) from the least-squares estimate, by
// weighted Gauss–Newton steps with the weights (-ln f)′(ε)/ε (iteratively reweighted least squares; Huber,
// Robust Statistics, 1981, §7.8).
#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "sysid/fit/pem.hpp"
#include "sysid/noise/likelihood.hpp"

namespace pendula::sysid {
namespace {

bool admissible(const Polynomials& p) {
  return stable(p.C) && std::all_of(p.F.begin(), p.F.end(), [](const Vec& f) { return stable(f); });
}

struct Problem {
  const IdData& d;
  Index output;
  const Orders& orders;
  Start start;
  NegativeLogarithm f;
  double value(const PredictionErrors& at) const {
    double sum = 0;
    for (const double e : at.e) sum += f(e)[0];
    return sum;
  }
  PredictionErrors errors(const Vec& theta) const {
    return prediction_errors(d, output, orders, theta, start, true);
  }
};

/// One step; false when no step along it lowers the value.
bool improve(const Problem& p, Vec& theta, PredictionErrors& at, double& value, double& size) {
  const double floor = 1e-9 * std::sqrt(at.e.squaredNorm() / static_cast<double>(at.e.size()));
  Vec w(at.e.size());
  for (Index t = 0; t < w.size(); ++t) {
    const double e = std::max(std::abs(at.e[t]), floor);
    w[t] = std::max(0.0, p.f(std::copysign(e, at.e[t]))[1] * std::copysign(1 / e, at.e[t]));
  }
  const Mat weighted = w.asDiagonal() * at.J;
  Mat H = at.J.transpose() * weighted;
  H.diagonal() *= 1 + 1e-12;
  const Vec step = -H.ldlt().solve(weighted.transpose() * at.e);
  if (!step.allFinite()) return false;
  for (double part = 1; part > 1e-9; part /= 2) {
    const Vec next = theta + part * step;
    if (!admissible(polynomials_of(next, p.orders))) continue;
    PredictionErrors there = p.errors(next);
    const double now = p.value(there);
    if (!(now < value)) continue;
    size = part * step.norm() / (theta.norm() + 1e-300);
    theta = next, at = std::move(there), value = now;
    return true;
  }
  return false;
}

}  // namespace

PolyModel pem(const IdData& d, Index output, const Orders& orders, const std::string& kind,
              const PemOptions& options, const Density& density) {
  if (density.kind == Density::Kind::uniform || density.kind == Density::Kind::exponential)
    throw Error(text(
        "this noise leaves a set or a corner of parameters, which is found for models that are linear in θ "
        "only: arx, fir, lsq, p:fit of a linear predictor"));
  PolyModel m = pem(d, output, orders, kind, options);
  if (m.rank < m.theta.size() || m.exact) return m;
  const Problem p{d, output, m.orders, options.start, negative_logarithm(density)};
  PredictionErrors at = p.errors(m.theta);
  double value = p.value(at), size = 0;
  if (!std::isfinite(value))
    throw Failure("the density is zero or undefined at an error of the least-squares estimate");
  int steps = 0;
  if (density.kind != Density::Kind::gaussian)
    for (; steps < 500; ++steps) {
      poll_interrupt();
      const double before = value;
      if (!improve(p, m.theta, at, value, size)) break;
      if (size < 1e-10 || before - value < 1e-14 * std::abs(value)) break;
    }
  const auto N = static_cast<double>(at.rows);
  LikelihoodFit fit;
  fit.theta = m.theta;
  double information = 0;  // of one sample, in units of the scale
  if (density.kind == Density::Kind::gaussian)
    fit.scale = density.scale.value_or(std::sqrt(at.e.squaredNorm() / N)),
    information = 1 / (fit.scale * fit.scale);
  else if (density.kind == Density::Kind::laplace)
    fit.scale = density.scale.value_or(at.e.lpNorm<1>() / N), information = 1 / (fit.scale * fit.scale);
  else
    for (const double e : at.e) information += std::pow(p.f(e)[1], 2) / N;
  if (density.kind == Density::Kind::gaussian)
    m.log_likelihood =
        -N * std::log(fit.scale * std::sqrt(2 * M_PI)) - at.e.squaredNorm() / (2 * fit.scale * fit.scale);
  else if (density.kind == Density::Kind::laplace)
    m.log_likelihood = -N * std::log(2 * fit.scale) - at.e.lpNorm<1>() / fit.scale;
  else
    m.log_likelihood = -value;
  m.covariance =
      (at.J.transpose() * at.J).ldlt().solve(Mat::Identity(m.theta.size(), m.theta.size())) / information;
  m.std = m.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  m.p = polynomials_of(m.theta, m.orders);
  m.noise = described(density, fit);
  m.search =
      text("maximum likelihood (", std::max(steps, 1), " weighted Gauss–Newton step", steps > 1 ? "s)" : ")");
  const Vec y = d.y.col(output);
  m.quality =
      criteria(at.e.squaredNorm(), at.rows, m.theta.size(), (y.array() - y.mean()).matrix().squaredNorm());
  m.simulation_fit = simulation_fit(m, d, Seed::estimate);
  return m;
}

}  // namespace pendula::sysid
