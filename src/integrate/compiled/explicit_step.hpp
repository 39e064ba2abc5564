// Whole steps as straight-line machine code.
//
// On a small model most of the time of a step goes into what surrounds the equations: calls, loops over a
// handful of numbers, stage sums, triangular solves. Here the equations of all stages, the sums of the
// tableau and the solutions with the factors at hand become one program, whose values live in registers. Its
// results are those of the loops it replaces, to rounding. There is none for long programs, where the
// equations themselves dominate.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "codegen/machine/machine.hpp"
#include "integrate/compiled/forcing.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/tolerances.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

/// Steps of an explicit method on an explicit ODE, with their error estimates.
class CompiledExplicitStep {
 public:
  /// The end of a step: x₁, x₁′ and the scaled error (n numbers each); sum and largest (0 below nine
  /// unknowns, see ErrorSum) of the squares of the scaled error, also with the second embedded method
  /// (or zeros); and for the test of stiffness the squares of ‖f(x₁) - f(g)‖ and ‖x₁ - g‖ with a second
  /// stage g at the end of the step (or zeros). near_conditions: x₁ violates none of the problem's
  /// projections by more than Problem::projection_share of what a change of every state by its tolerance
  /// would do (Problem::project_if_needed).
  struct End {
    const double *x, *xdot, *scaled;
    double sum, largest, second_sum, second_largest, slope_change, change;
    bool near_conditions;
  };

  /// Nothing where there is no machine code or it would be long. Remembered for equal equations and tableau.
  /// stiff_stage: g (StepRules).
  static std::shared_ptr<CompiledExplicitStep> make(const Problem& problem, const Tableau& rk,
                                                    std::optional<int> stiff_stage,
                                                    const Tolerances& tolerances);
  /// Inputs of the model are evaluated at the stages through `problem`. Valid until the next run.
  End run(Problem& problem, const Point& from, double dt);

 private:
  std::vector<double> c_, in_, out_, work_;  ///< c_: where there are stages behind the first, each once
  std::size_t stages_ = 0;                   ///< where they begin, in in_
  std::optional<TimeCode> time_;
  std::size_t parts_ = 0;  ///< of it
  std::shared_ptr<const codegen::Machine> machine_;
};

}  // namespace pendula::integrate
