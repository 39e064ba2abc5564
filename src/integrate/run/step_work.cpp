#include "integrate/run/step_work.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/solve/band_lu.hpp"

namespace pendula::integrate {

std::optional<StepWork> StepWork::of(const Problem& problem) {
  constexpr double full = 0.3;     // of the entries: dense elimination
  constexpr double shorter = 2.4;  // loops over the rows of a grid
  const int n = problem.n();
  if (!problem.is_ode() || problem.m() > 0 || n <= small || problem.has_dense_jacobian()) return {};
  std::vector<Position> positions;
  for (const Problem::Entry& e : problem.pattern())
    positions.push_back({e.row, e.column < n ? e.column : e.column - n});
  const auto band = BandOrder::find(n, positions);
  double width = band ? band->below : std::sqrt(n);
  if (static_cast<double>(positions.size()) > full * n * n) width = n / 2.0;
  return StepWork(n, (band ? 1 : shorter) * static_cast<double>(problem.operations()), width);
}

double StepWork::radau_step(double rtol) const {
  constexpr double few_digits = 1e-4;  // IrkStepper::first_level
  if (rtol >= few_digits) return n_ * (830 + 220 * width_) + 10 * operations_;
  return n_ * (1900 + 250 * width_) + 20 * operations_;
}

/// The size of steps that the error allows: 3 rtol^(-1/3) steps; stages from the stability of RKC, 0.65 s² (Sommeijer,
/// Shampine & Verwer 1998).
double StepWork::chebyshev_run(const Rates& rates, double span, double rtol) const {
  const double steps = 3 / std::cbrt(rtol), stages = steps * std::sqrt(1 + 1.5 * rates.damped * span / steps);
  return stages * (operations_ + 8 * n_);
}

double usual_radau_steps(double rtol) {
  const double digits = -std::log10(rtol);
  return digits <= 4 ? 25 : std::max(11.0, 13 * std::pow(1.3, digits - 6));
}

double usual_rosenbrock_steps(double rtol) { return 30 * std::pow(1e4 * rtol, -0.25); }

}  // namespace pendula::integrate
