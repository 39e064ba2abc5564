// Whole steps as straight-line machine code.
//
// On a small model most of the time of a step goes into what surrounds the equations: calls, loops over a
// handful of numbers, stage sums, triangular solves. Here the equations of all stages, the sums of the
// tableau and the solutions with the factors at hand become one program, whose values live in registers. Its
// results are those of the loops it replaces, to rounding. There is none for long programs, where the
// equations themselves dominate.
#pragma once

#include <memory>
#include <vector>

#include "codegen/machine.hpp"
#include "integrate/problem.hpp"
#include "integrate/tableau.hpp"

namespace pendula::integrate {

/// All stages of an explicit method on an explicit ODE: x₁ = x + h Σ bᵢ Kᵢ and the error estimates.
class ExplicitCode {
 public:
  /// Nothing where there is no machine code or it would be long. Remembered for equal equations and tableau.
  static std::shared_ptr<ExplicitCode> make(const Problem& problem, const Tableau& rk);

  /// out: K₂ … K_s, x₁, h Σ (bᵢ - b̂ᵢ) Kᵢ, and the same with a second embedded method (or zeros): (s + 2) n
  /// numbers. Inputs of the model are evaluated at the stages through `problem`.
  void run(Problem& problem, const Point& from, double dt, double* out);

 private:
  std::vector<double> c_, in_, work_;
  std::shared_ptr<const codegen::Machine> machine_;
};

}  // namespace pendula::integrate
