// Are the tolerances above the effect of rounding? Propagates rounding errors of the equations along a
// solution and compares the result with the tolerances at its end.
#pragma once

#include <string>
#include <vector>

#include "integrate/problem/problem.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

/// The effect of rounding errors of the residuals, propagated by the linearised equations. Measured in steps
/// 8, 16, 32, … of models of index 0 and 1 with up to some hundred unknowns, where tolerances are tight; in
/// steps 1, 2, 4, … and at any tolerance where `everywhere`.
class RoundingWatch {
 public:
  RoundingWatch(const Problem& problem, const Tolerances& tolerances, const std::vector<int>& variable_index,
                bool everywhere);

  bool wants(long steps) const { return active_ && steps >= next_; }
  /// After a step. Cost: one Jacobian, two factorisations, nine solutions.
  void after(Problem& problem, const Point& before, const Point& here, long steps);
  /// The line of stats() at the end of a run; empty: rounding errors are harmless.
  std::string remark(Problem& problem, const Point& end) const;

 private:
  Tolerances tolerances_;
  bool active_;
  long last_ = 0, next_;
  double t_ = 0;               ///< of the last measurement
  std::vector<double> error_;  ///< of (x, z), there
};

}  // namespace pendula::integrate
