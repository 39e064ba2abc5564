// Prediction-error estimates of A y = Σ B_i/F_i u_i + C/D e: min Σ ε(t, θ)², by Gauss–Newton steps with
// Levenberg–Marquardt damping where they fail, and exact gradients from filters (Ljung, 2nd ed., §10.2–10.3;
// docs/derivations.md#prediction-errors):
//   w_i = B_i/F_i u_i,  v = A y - Σ w_i,  ε = D/C v
//   ∂ε/∂a_k = D/C y(t-k)            ∂ε/∂b_k = -D/(C F) u(t-k)     ∂ε/∂f_k = D/(C F) w(t-k)
//   ∂ε/∂c_k = -1/C ε(t-k)           ∂ε/∂d_k = 1/C v(t-k)
#pragma once

#include <optional>

#include "sysid/model/model.hpp"
#include "sysid/noise/likelihood.hpp"

namespace pendula::sysid {

/// ε and its gradient at θ, one experiment after the other. InitialCondition::estimate adds the response to
/// an unknown initial state (impulses in the first memory() rows through 1/(C F)), fitted by linear least
/// squares at every θ; its effect is projected out of the gradient (Kaufman, BIT 15, 1975).
struct PredictionErrors {
  Vec e;
  Mat J;                 ///< N×d
  Index free_start = 0;  ///< number of initial values fitted
  Index rows = 0;        ///< rows that count
  double unit = 1;       ///< e and J are in units of 1/unit (missing samples)
};
PredictionErrors prediction_errors(const IdData& d, Index output, const Orders& orders, const Vec& theta,
                                   InitialCondition start, bool gradient);

/// Σ (y - ȳ)² over the samples whose errors count.
double compared_variation(const IdData& d, const PolyModel& m);

struct PemOptions {
  InitialCondition start = InitialCondition::estimate;
  int iterations = 200;      ///< a cap; the report says where it ended a search
  std::optional<Vec> theta;  ///< where to begin; otherwise from linear estimates
};
/// kind: for the heading. Missing samples of y are bridged by a Kalman filter (ic = "drop" then
/// estimates, too). throws Error on missing inputs, Failure when the search cannot begin. Cost
/// per iteration: N (filters + d²).
PolyModel pem(const IdData& d, Index output, const Orders& orders, const std::string& kind,
              const PemOptions& options);

/// Maximum likelihood for a density of ε with values for every e: Gaussian, Laplace, user.
/// Asymptotic covariance (I JᵀJ)⁻¹ with the Fisher information I of one sample. Throws Error for
/// uniform and exponential noise.
PolyModel pem(const IdData& d, Index output, const Orders& orders, const std::string& kind,
              const PemOptions& options, const Density& density);

/// Starting values by linear steps: high-order ARX for the innovations (Hannan & Rissanen, Biometrika 69,
/// 1982), Steiglitz–McBride iterations for B/F (IEEE Trans. Autom. Control 10, 1965).
struct StartingValues {
  Vec theta;
  std::string name;  ///< which estimate, in words
};
std::vector<StartingValues> starting_values(const IdData& d, Index output, const Orders& orders);

}  // namespace pendula::sysid
