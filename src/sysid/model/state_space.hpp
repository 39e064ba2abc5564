// State-space models in innovations form,
//
//   x(t+1) = A x(t) + B u(t) + K e(t),   y(t) = C x(t) + D u(t) + e(t),
//
// (Ljung, System Identification, 2nd ed., §4.3).
#pragma once

#include "sysid/model/id_model.hpp"

namespace pendula::sysid {

struct StateSpaceModel {
  Mat A, B, C, D, K;
  std::vector<Vec> x0;            ///< state at the first sample of each experiment of the estimation data
  Vec singular_values;            ///< by which the order is judged, all of them
  Index horizon = 0;              ///< block rows of past and future
  std::string weighting, choice;  ///< which weighting; how the order was chosen, in words
  Mat innovations;                ///< covariance of e
  bool feedthrough = false;
  std::string refinement;  ///< in words, where prediction errors were minimised
  Mat covariance;          ///< then of the entries of A, B, C, D, K, column by column; coordinates stay free
  std::vector<std::string> free_inputs;  ///< combinations of the columns of B that the inputs leave open
  Index order() const { return A.rows(); }
  /// Free parameters, coordinates of the state not counted: n (2 p + m) + p m, without K n (p + m) + p m.
  Index parameters() const;
};

/// ŷ(t|t-horizon), 0: simulation. Seed::zero starts at x = 0, else the initial state is fitted.
std::vector<Response> predict(const StateSpaceModel& m, const IdData& d, Index horizon, Seed seed);

double spectral_radius(const Mat& A);

/// A, B, C, D, K of a model whose outputs feed each other, A(q) y = B(q) u + e: the observer form with
/// p·max(na, nb) states. Requires m.coupled.
StateSpaceModel observer_form(const IdModel& m);

std::string describe_state_space(const IdModel& m);

}  // namespace pendula::sysid
