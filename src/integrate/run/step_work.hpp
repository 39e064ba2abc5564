// What a step of each method costs on a model, counted from its equations, and what a run would cost: large explicit
// ODEs with sparse Jacobians, where the cost of linear systems differs most.
#pragma once

#include <optional>

#include "integrate/problem/problem.hpp"
#include "integrate/step/spectrum.hpp"

namespace pendula::integrate {

/// Work in operations of the compiled equations, some 0.18 ns each. Factorisations and solutions grow with the number
/// of unknowns and with the width of the band, or of the separators of a grid. Factors are fitted to measured steps of
/// Brusselators, Burgers' and Fisher's equations, Gray & Scott's and the heat equation on 50 … 500 points
/// (docs/performance.md).
class StepWork {
 public:
  /// Nothing for small models, whose steps are machine code, and where z has to be solved for.
  static std::optional<StepWork> of(const Problem& problem);
  static constexpr int small = 60;  ///< unknowns

  double explicit_step(int stages) const { return stages * (operations_ + 5 * n_) + 65 * n_; }
  /// Radau IIA: of order 5 where few digits are asked for, else of order 9.
  double radau_step(double rtol) const;
  double rosenbrock_step() const { return n_ * (560 + 56 * width_) + 8 * operations_; }
  /// A whole interval by a Chebyshev method.
  double chebyshev_run(const Rates& rates, double span, double rtol) const;

 private:
  StepWork(double n, double operations, double width) : n_(n), operations_(operations), width_(width) {}
  double n_, operations_, width_;
};

/// Steps of an implicit method over an interval in which a solution changes as those of the models above did: their
/// median. Of the others the easiest takes less than half of it, the hardest three times as many.
double usual_radau_steps(double rtol);
double usual_rosenbrock_steps(double rtol);

/// |λ| h of the explicit pairs on the negative real axis at the limit of stability: 5.9 … 6.4 for orders 7 and 8.
constexpr double stability_limit = 6;

}  // namespace pendula::integrate
