// What a step of each method costs on a model, counted from its equations, and what a run would cost: large
// explicit ODEs with sparse Jacobians, where the cost of linear systems differs most.
#pragma once

#include <optional>

#include "integrate/problem/problem.hpp"
#include "integrate/step/spectrum.hpp"

namespace pendula::integrate {

/// Work in ns of the processor of docs/performance.md, where the measured steps are to which the factors are
/// fitted: only ratios count. Factorisations and solutions grow with the number of unknowns and with the
/// width of the band, or of the separators of a grid. Operations of the equations count little where four of
/// neighbours are done at a time, functions like exp much.
class StepWork {
 public:
  /// Nothing for small models, whose steps are machine code, and where z has to be solved for.
  static std::optional<StepWork> of(const Problem& problem);
  static constexpr int small = 60;  ///< unknowns

  double explicit_step(int stages) const { return 770 + 1.1 * stages * evaluation(); }
  /// Radau IIA: of order 5 where few digits are asked for, else of order 9.
  double radau_step(double rtol) const;
  double rosenbrock_step() const { return n_ * (200 + 14 * width_) + 100 * calls_; }
  double bdf_step() const { return n_ * (90 + 6 * width_) + 0.6 * operations_ + 30 * calls_; }
  /// A whole interval by a Chebyshev method.
  double chebyshev_run(const Rates& rates, double span, double rtol) const;

 private:
  StepWork(double n, double operations, double calls, double width)
      : n_(n), operations_(operations), calls_(calls), width_(width) {}
  static std::optional<StepWork> count(const Problem& problem);
  /// x′, and the sum for the next stage.
  double evaluation() const { return 0.1 * operations_ + 1.7 * n_ + 9 * calls_; }
  double n_, operations_, calls_, width_;
};

/// Whether an explicit step whose every stage iterates for z takes more work than an implicit one: such a
/// stage is two iterations with two matrices, each as long as one of three or five in a step of Radau IIA,
/// which has three matrices in all. Measured, explicit ÷ implicit: 7 unknowns 2.3, 11 1.0, 40 0.4 … 0.7, 80
/// 0.5; where explicit steps are as long, which they seldom are.
constexpr bool iterated_stages_cost_more(int unknowns) { return unknowns <= 15; }

/// Steps of an implicit method over an interval in which a solution changes as those of docs/performance.md
/// do: their median. Of the others the easiest takes less than half of it, the hardest three times as many.
double usual_radau_steps(double rtol);
double usual_rosenbrock_steps(double rtol);
double usual_bdf_steps(double rtol);

/// The limit of stability of the explicit pairs on the negative real axis, as |λ| h:
/// 5.9 … 6.4 for orders 7 and 8.
constexpr double stability_limit = 6;

}  // namespace pendula::integrate
