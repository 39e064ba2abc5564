// x′ and z behind a jump that carries them across borders: the flow through a pipe, p - q = K v |v|, when the
// pump is reversed. With the branch in force before the jump, v |v| = σ v², there may be no solution at all.
#pragma once

#include <memory>
#include <vector>

#include "integrate/event/surfaces.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/run/adaptive_state.hpp"

namespace pendula::integrate {

class AcrossBorders {
 public:
  /// Requires that the state outlives it.
  explicit AcrossBorders(AdaptiveState& state) : state_(state) {}

  /// Newton's iteration, damped, in which every branch that depends on x′ or z is evaluated as it is written,
  /// if the equations are continuous across its border; the other branches are those of `modes`. t and x of
  /// the point are kept. False, and the point unchanged, where it finds no solution, or the solution slides
  /// along a border. treatment: by surface, as it is now.
  bool solve(Point& point, const std::vector<double>& modes, const std::vector<Treatment>& treatment);

 private:
  void make(const std::vector<Treatment>& treatment);

  AdaptiveState& state_;
  std::vector<Treatment> made_for_;
  ProblemPtr live_;  ///< nullptr: no branch depends on x′ and z
  std::unique_ptr<RhsSolver> equations_;
};

}  // namespace pendula::integrate
