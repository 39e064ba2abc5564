// Cost of an integration, in counts.
#pragma once

#include <optional>

namespace pendula::integrate {

struct Stats {
  long steps = 0;
  long rejected = 0;     ///< steps that were tried and repeated with a smaller one
  long evaluations = 0;  ///< of F or f, one per stage
  long jacobians = 0;    ///< of F, one per point
  long factorisations = 0;
  long newton_iterations = 0;
  double errors = 0;  ///< of the steps, as they are estimated, in tolerances: the sum
  /// The run says so where `errors` is larger; sol:check() confirms up to as many tolerances.
  static constexpr double many_errors = 100;
  std::optional<double> rest;  ///< when the solution almost stood still before it moved
};

}  // namespace pendula::integrate
