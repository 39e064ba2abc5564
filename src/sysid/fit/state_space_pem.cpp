#include "sysid/fit/state_space_pem.hpp"

#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/fit/bounded_search.hpp"
#include "sysid/model/kalman_errors.hpp"
#include "sysid/model/state_space_fit.hpp"

namespace pendula::sysid {
namespace {

/// The free entries in the order of StateSpaceModel::covariance, then the initial states.
class Entries {
 public:
  explicit Entries(const StateSpaceModel& m) : m_(m), noise_(!m.K.isZero(0)) {}

  template <class Visit>
  static void visit(StateSpaceModel& m, bool noise, const Visit& v) {
    v(m.A);
    v(m.B);
    v(m.C);
    if (m.feedthrough) v(m.D);
    if (noise) v(m.K);
  }

  Vec theta() {
    std::vector<double> all;
    visit(m_, noise_, [&](const Mat& M) { all.insert(all.end(), M.data(), M.data() + M.size()); });
    count_ = static_cast<Index>(all.size());
    for (const Vec& x : m_.x0) all.insert(all.end(), x.begin(), x.end());
    return Eigen::Map<const Vec>(all.data(), static_cast<Index>(all.size()));
  }

  const StateSpaceModel& at(const Vec& theta) {
    Index next = 0;
    visit(m_, noise_, [&](Mat& M) {
      M = theta.segment(next, M.size()).reshaped(M.rows(), M.cols());
      next += M.size();
    });
    for (Vec& x : m_.x0) {
      x = theta.segment(next, x.size());
      next += x.size();
    }
    return m_;
  }

  Index count() const { return count_; }  ///< without the initial states

 private:
  StateSpaceModel m_;
  bool noise_;
  Index count_ = 0;
};

/// y - ŷ of the predictor x⁺ = (A - K C) x + (B - K D) u + K y for complete data.
Mat one_step_errors(const StateSpaceModel& m, const IdData& d) {
  Mat e(d.outputs(), d.samples());
  const Mat y = d.y.transpose();
  const Mat u = d.u.transpose();
  Vec x(m.order());
  Vec next(m.order());
  for (Index k = 0; k < d.experiments(); ++k) {
    x = m.x0[k];
    for (Index t = d.starts[k]; t < d.end(k); ++t) {
      e.col(t) = y.col(t);
      e.col(t).noalias() -= m.C.lazyProduct(x);
      if (m.feedthrough) e.col(t).noalias() -= m.D.lazyProduct(u.col(t));
      next.noalias() = m.A.lazyProduct(x);
      next.noalias() += m.B.lazyProduct(u.col(t));
      next.noalias() += m.K.lazyProduct(e.col(t));
      x.swap(next);
    }
  }
  return e;
}

/// The residuals to be minimised for a given Λ.
Vec residuals(const StateSpaceModel& m, const Mat& Lambda, const IdData& d, bool gaps) {
  if (!(spectral_radius(m.A - m.K * m.C) < 1))
    return Vec::Constant(1, std::numeric_limits<double>::quiet_NaN());
  if (!gaps) return Lambda.llt().matrixL().solve(one_step_errors(m, d)).reshaped();
  const KalmanErrors e = kalman_errors(m, Lambda, d, FirstState::given);
  // the likelihood with its scale eliminated: (Π det S)^(1/N) Σ |whitened|²
  return std::exp(e.log_det / (2 * static_cast<double>(e.whitened.size()))) * e.whitened;
}

/// The covariance of the innovations, from complete samples.
Mat innovation_covariance(const StateSpaceModel& m, const Mat& Lambda, const IdData& d, bool gaps) {
  if (!gaps) {
    const Mat e = one_step_errors(m, d);
    return e * e.transpose() / static_cast<double>(e.cols());
  }
  const KalmanErrors e = kalman_errors(m, Lambda, d, FirstState::given);
  const Mat scaled = (d.y - e.predicted).array() / e.deviation.array();
  const Vec size = Lambda.diagonal().cwiseSqrt();
  Mat out = Mat::Zero(d.outputs(), d.outputs());
  double count = 0;
  for (Index t = 0; t < d.samples(); ++t) {
    if (scaled.row(t).hasNaN()) continue;
    out += size.asDiagonal() * scaled.row(t).transpose() * scaled.row(t) * size.asDiagonal();
    count += 1;
  }
  return out / std::max(count, 1.0);
}

}  // namespace

IdModel refined(StateSpaceModel m, const IdData& d, int iterations) {
  require_inputs(d);
  const bool gaps = missing(d) > 0;
  const Index p = d.outputs();
  if (!(spectral_radius(m.A - m.K * m.C) < 1)) throw Error("the predictor of the model is unstable");
  m.x0 = kalman_errors(m, Mat::Identity(p, p), d, FirstState::estimated).x0;
  Mat Lambda = innovation_covariance(m, Mat::Identity(p, p), d, gaps);
  if (!(Lambda.diagonal().minCoeff() > 0) || Lambda.llt().info() != Eigen::Success)
    return completed(std::move(m), d, true);
  Entries entries(m);
  Vec theta = entries.theta();
  int steps = 0;
  BoundedMinimum best;
  // with several outputs Λ comes from the errors of the pass before; a cap, for most data Λ settles earlier
  constexpr int most_passes = 5;
  for (int pass = 0; pass < (p == 1 ? 1 : most_passes); ++pass) {
    const auto errors = [&](const Vec& at) { return residuals(entries.at(at), Lambda, d, gaps); };
    constexpr double small = 1e-3;  // entries that are nearly 0 are stepped over as if they had this size
    const Vec sizes = Vec::Constant(theta.size(), small * (1 + theta.cwiseAbs().mean()));
    // Directions that change coordinates only have slopes of 1e-9 by differences.
    constexpr double accuracy = 1e-7;
    best = least_squares_within(errors, theta, {}, sizes, iterations, accuracy);
    theta = best.search.theta;
    steps += best.search.iterations;
    const Mat before = Lambda;
    Lambda = innovation_covariance(entries.at(theta), Lambda, d, gaps);
    constexpr double settled = 1e-6;  // far below the standard error of a variance, √(2/N)
    if ((Lambda - before).norm() <= settled * Lambda.norm()) break;
  }
  m = entries.at(theta);
  const double variance = best.residuals.squaredNorm() / static_cast<double>(best.residuals.size());
  const Mat JTJ = best.J.transpose() * best.J;
  Eigen::CompleteOrthogonalDecomposition<Mat> inverse;
  inverse.setThreshold(1e-11);  // 3e-6 of J, between its slopes and those of changed coordinates, 1e-9
  m.covariance =
      (variance * pseudo_inverse(inverse.compute(JTJ))).topLeftCorner(entries.count(), entries.count());
  const std::string ending = ending_text(best.search);
  m.refinement = text("prediction errors minimised (", steps, steps == 1 ? " step" : " steps",
                      ending.empty() ? ")" : "; " + ending + ")",
                      gaps ? text(", ", missing(d), " missing samples bridged by Kalman filter") : "");
  m.innovations = Lambda;
  return completed(std::move(m), d, false);
}

}  // namespace pendula::sysid
