// How equations that do not determine x′ and z, or are not finite, are detected and reported.
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/column_scale.hpp"

#include <cmath>

#include "base/text.hpp"

namespace pendula::integrate {

/// Scaling the rows is not enough where, for instance, masses of 10⁻¹² and forces of 1 share a row. Without
/// straight-line code: whether there is some depends on earlier runs, and its pivots are those of other
/// matrices.
bool RhsSolver::is_regular_in_other_units() const {
  using Solver = LinearSolver<double>;
  std::vector<double> sizes = entries_;
  for (double& entry : sizes) entry = std::fabs(entry);
  for (const auto scale : {&column_scale, &balanced_column_scale}) {
    const std::vector<double> column = scale(solver_.size(), layout_->positions, sizes);
    if (column.empty()) continue;
    std::vector<double> scaled = entries_;
    for (std::size_t k = 0; k < scaled.size(); ++k) scaled[k] *= column[layout_->positions[k].column];
    Solver solver;
    solver.analyse(
        solver_.size(), layout_->positions,
        solver_.size() <= Solver::dense_limit ? Solver::Factorisation::dense : Solver::Factorisation::band);
    if (solver.factorise(scaled.data()) && solver.weakest_pivot() > least_pivot) return true;
  }
  return false;
}

std::string RhsSolver::reason() const {
  switch (trouble_) {
    case Trouble::none:
      return "";
    case Trouble::singular:
      return "the equations do not determine x′ and z there";
    case Trouble::diverged:
      return "x′ and z could not be computed there: Newton did not converge";
    case Trouble::far:
      return "x′ and z change so much there that their branch cannot be followed";
    case Trouble::not_finite:
      break;
  }
  const std::string who = ode_ ? problem_->xdot_name(failed_row_) : problem_->equation_name(failed_row_);
  return text(who, " is not finite there: the equations are not defined");
}

bool RhsSolver::settle(Point& point) {
  Vec xdot = point.xdot, z = point.z;
  const bool solved = solve(point.t, point.x.data(), xdot.data(), z.data(), false), regular = is_regular();
  if (solved && regular) {
    point.xdot = xdot;
    point.z = z;
    return true;
  }
  if (!solved && regular && trouble_ != Trouble::singular) throw Failure(reason());
  return false;
}

void RhsSolver::require(double t, const double* x, double* xdot, double* z) {
  if (solve(t, x, xdot, z, false)) return;
  if (trouble_ == Trouble::singular) throw OpenEquations(reason());
  if (trouble_ == Trouble::not_finite) throw UndefinedEquations(reason());
  throw Failure(reason());
}

}  // namespace pendula::integrate
