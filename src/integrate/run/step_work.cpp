#include "integrate/run/step_work.hpp"

#include <algorithm>
#include <cmath>

#include "expr/graph/operation.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/solve/band_lu.hpp"

namespace pendula::integrate {

/// True for exp, sin …, and powers with symbolic exponents.
static bool calls_function(Expr e) {
  if (e.op() < first_op || e.op() >= end_op || code_kind(e.op()) == CodeKind::direct) return false;
  return e.op() != Op::pow || !e.operand(1).is_constant();
}

std::optional<StepWork> StepWork::of(const Problem& problem) {
  static PerEquations<std::optional<StepWork>> known;
  return known.of(problem, [&] { return count(problem); });
}

std::optional<StepWork> StepWork::count(const Problem& problem) {
  constexpr double full = 0.3;  // share of nonzero entries from which elimination is dense
  const int n = problem.n();
  if (!problem.is_ode() || problem.m() > 0 || n <= small || problem.has_dense_jacobian()) return {};
  std::vector<Position> positions;
  for (const Problem::Entry& e : problem.pattern())
    positions.push_back({e.row, e.column < n ? e.column : e.column - n});
  const auto band = BandOrder::find(n, positions);
  // Separator width of a grid whose rows couple to four neighbours; larger stencils and several unknowns per
  // point widen it in proportion.
  const double neighbours = static_cast<double>(positions.size()) / n - 1;
  double width = band ? band->below : std::sqrt(n) * std::max(1.0, neighbours / 4);
  if (static_cast<double>(positions.size()) > full * n * n) width = n / 2.0;
  const std::vector<Expr> nodes = topological(problem.model().f);
  const auto calls = std::count_if(nodes.begin(), nodes.end(), calls_function);
  return StepWork(n, static_cast<double>(problem.operations()), static_cast<double>(calls), width);
}

double StepWork::radau_step(double rtol) const {
  constexpr double few_digits = 1e-4;  // IrkStepper::first_level
  if (rtol >= few_digits) return n_ * (330 + 45 * width_) + operations_ + 80 * calls_;
  return n_ * (540 + 55 * width_) + 13 * operations_ + 100 * calls_;
}

/// Accuracy determines the number of steps, 3 rtol^(-1/3); the stability of RKC, 0.65 s², determines the
/// stages (Sommeijer, Shampine & Verwer 1998).
double StepWork::chebyshev_run(const Rates& rates, double span, double rtol) const {
  const double steps = 3 / std::cbrt(rtol), stages = std::sqrt(1 + 1.5 * rates.damped * span / steps);
  return steps * (230 + 6 * n_ + stages * evaluation());
}

double usual_radau_steps(double rtol) {
  const double digits = -std::log10(rtol);
  return digits <= 4 ? 22 : std::max(15.0, 18 * std::pow(1.28, digits - 6));
}

double usual_rosenbrock_steps(double rtol) { return 30 * std::pow(1e4 * rtol, -0.25); }

double usual_bdf_steps(double rtol) { return 85 * std::pow(1e4 * rtol, -0.2); }

}  // namespace pendula::integrate
