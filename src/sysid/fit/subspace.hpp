// State-space models by subspace methods (Ljung, 2nd ed., §10.6; docs/derivations.md#subspaces).
#pragma once

#include "sysid/model/state_space.hpp"

namespace pendula::sysid {

struct SubspaceOptions {
  int order = 0;             ///< 0: chosen between `least` and `most`
  int least = 1, most = 10;  ///< a choice; `most` sets the horizon, and with it the samples that are needed
  int horizon = 0;           ///< 0: chosen
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

/// The solution K = (A P Cᵀ + S)(C P Cᵀ + R)⁻¹ of the stationary Kalman filter, by iteration of the Riccati
/// equation. Requires R positive definite.
Mat kalman_gain(const Mat& A, const Mat& C, const Mat& Q, const Mat& S, const Mat& R);

}  // namespace pendula::sysid
