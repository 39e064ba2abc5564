// State-space models in innovations form,
//
//   x(t+1) = A x(t) + B u(t) + K e(t),   y(t) = C x(t) + D u(t) + e(t),
//
// and their estimation by subspace methods (Ljung, 2nd ed., §§4.3, 10.6; docs/derivations.md#subspaces).
#pragma once

#include "sysid/fit/estimators.hpp"

namespace pendula::sysid {

struct StateSpaceModel {
  Mat A, B, C, D, K;
  std::vector<Vec> x0;            ///< state at the first sample of each experiment of the estimation data
  Vec singular_values;            ///< by which the order is judged, all of them
  Index horizon = 0;              ///< block rows of past and future
  std::string weighting, choice;  ///< which weighting; how the order was chosen, in words
  Mat innovations;                ///< covariance of e
  bool feedthrough = false;
  Index order() const { return A.rows(); }
  /// Free parameters, coordinates of the state not counted: n (2 p + m) + p m, without K n (p + m) + p m.
  Index parameters() const;
};

struct SubspaceOptions {
  int order = 0;  ///< 0: chosen between `least` and `most`
  int least = 1, most = 10;
  int horizon = 0;                ///< 0: chosen
  std::string weighting = "CVA";  ///< "CVA", "MOESP", "N4SID"
  bool feedthrough = false;       ///< estimate D; otherwise D = 0
  bool noise = true;              ///< estimate K; otherwise K = 0 (output error)
};

/// Subspace identification: the extended observability matrix Γ from an LQ factorisation of block Hankel
/// matrices and a weighted singular value decomposition (Van Overschee & De Moor, Automatica 31(12), 1995;
/// weightings: their table 1), A and C from its shift structure, K from the Riccati equation of the
/// residuals of the states, then B, D and x(1) by linear least squares on the one-step errors. Several
/// outputs and inputs, several experiments, time series; no search, no starting values. Order 0: the least
/// σ²(n+1) + d(n) ln N / N over the canonical correlations (Bauer, Automatica 37, 2001).
/// throws Error on missing samples and too few of them. Cost: N (2 i (p + m))² for i block rows.
IdModel subspace(const IdData& d, const SubspaceOptions& options);

/// ŷ(t|t-horizon), 0: simulation. Seed::zero starts at x = 0, else the initial state is fitted.
std::vector<Response> predict(const StateSpaceModel& m, const IdData& d, Index horizon, Seed seed);

/// The solution K = (A P Cᵀ + S)(C P Cᵀ + R)⁻¹ of the stationary Kalman filter, by iteration of the Riccati
/// equation. Requires R positive definite.
Mat kalman_gain(const Mat& A, const Mat& C, const Mat& Q, const Mat& S, const Mat& R);
double spectral_radius(const Mat& A);

/// A, B, C, D, K of a model whose outputs feed each other, A(q) y = B(q) u + e: the observer form with
/// p·max(na, nb) states. Requires m.coupled.
StateSpaceModel observer_form(const IdModel& m);

std::string describe_state_space(const IdModel& m);

}  // namespace pendula::sysid
