// One-step predictions where samples of y are missing: the Kalman filter of the innovations form
//
//   x⁺ = A x + B u + K e,  y = C x + D u + e,  E e eᵀ = Λ.
//
// Given the past, x is known as long as every y is measured. Where one is missing its innovation
// stays unknown, the covariance P of x grows by K Λ Kᵀ, and the gain is that of the time-varying
// filter until P has died out (Jones, Technometrics 22(3), 1980; Harvey, Forecasting, Structural
// Time Series Models, 1989, §3.4.7).
#pragma once

#include "sysid/model/state_space.hpp"

namespace pendula::sysid {

struct KalmanErrors {
  Mat predicted;          ///< ŷ(t|t-1), N×p, also where y is missing
  Mat deviation;          ///< of y - ŷ, N×p
  Vec whitened;           ///< S^(-1/2)(y - ŷ) of the samples that are there, S the covariance of y - ŷ
  double log_det = 0;     ///< Σ ln det S
  std::vector<Vec> x0;    ///< the state at the first sample of each experiment
  std::vector<Mat> P, x;  ///< with `keep`: covariance and mean of the state at each sample, before its y
};
/// The states at the first samples: 0; those that make Σ|whitened|² least; m.x0.
enum class FirstState { zero, estimated, given };
/// Λ: p×p, positive definite. Inputs must be complete. Cost: N n³ while samples are missing, N n² otherwise.
KalmanErrors kalman_errors(const StateSpaceModel& m, const Mat& Lambda, const IdData& d, FirstState first,
                           bool keep = false);
/// Predictions and simulations (horizon 0) across missing samples of y; compared where there are some.
std::vector<Response> predict_with_gaps(const StateSpaceModel& m, const Mat& Lambda, const IdData& d,
                                        Index horizon, Seed seed);

/// A polynomial model as innovations form in observer coordinates (Ljung, 2nd ed., §4.3).
StateSpaceModel innovations_form(const PolyModel& m);
/// Any model, with the covariance of its innovations (from the estimation; 1 where there was none).
std::pair<StateSpaceModel, Mat> innovations_form(const IdModel& m);

/// throws  Error that names missing inputs; y may miss samples
void require_inputs(const IdData& d);

struct Forecast {
  Mat y, std;  ///< one row per future sample
};
/// ŷ(N + k | N) with future inputs u, one row per step. std without the uncertainty of the parameters.
Forecast forecast(const IdModel& m, const IdData& d, const Mat& u, Index steps);

}  // namespace pendula::sysid
