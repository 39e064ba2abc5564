// The Kalman filter from a known start, with its gain of every sample, and the smoother behind it.
//
//   x(k+1) = A x(k) + B u(k) + w(k),  y(k) = C x(k) + D u(k) + v(k),  E wwᵀ = Q, E vvᵀ = R, E wvᵀ = 0
//
// Joseph's form of the update (Bucy & Joseph, Filtering for Stochastic Processes, 1968); samples of y that
// are NaN are not used; smoothing by Rauch, Tung & Striebel, AIAA J. 3(8), 1965.
#pragma once

#include "lti/system.hpp"

namespace pendula::lti {

struct FilterRun {
  Mat predicted, filtered, smoothed;  ///< states, one row per sample: x̂(k|k-1), x̂(k|k), x̂(k|N) (if asked for)
  Mat std, smoothed_std;              ///< of the filtered (smoothed) states
  Mat y, innovations;                 ///< ŷ(k|k-1); y - ŷ (NaN where y is missing)
  std::vector<Mat> gains;             ///< x̂(k|k) = x̂(k|k-1) + gain (y - ŷ)
  Mat P;                              ///< covariance of x(N+1) given all y
  Vec next;                           ///< x̂(N+1|N)
  double log_likelihood = 0;
};
/// g in discrete time; u: N×m, y: N×p; x0, P0: mean and covariance of x(1). Q (n×n), R (p×p) positive
/// semidefinite. Throws Error on sizes, continuous g, covariances of innovations that are singular
FilterRun kalman_filter(const System& g, const Mat& Q, const Mat& R, const Mat& u, const Mat& y,
                        const Vec& x0, const Mat& P0, bool smooth);

}  // namespace pendula::lti
