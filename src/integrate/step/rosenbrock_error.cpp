// The error estimates of a Rosenbrock step: by its embedded method, and with the Jacobian at its end.
#include <algorithm>
#include <cmath>

#include "integrate/solve/vector_sums.hpp"
#include "integrate/step/rosenbrock_stepper.hpp"

namespace pendula::integrate {

double RosenbrockStepper::error_norm() {
  combine(n(), y_.data(), sums_.m, U_.data(), N_, next_.x.data());
  combine(m(), y_.data() + n(), sums_.m, U_.data() + n(), N_, next_.z.data());
  combine(N_, nullptr, sums_.e, U_.data(), N_, scaled_.data());
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) {
    const double before = std::fabs(y_[k]), after = std::fabs(k < n() ? next_.x[k] : next_.z[k - n()]);
    scaled_[k] /= weight(k, std::max(before, after));
    sum.add(scaled_[k]);
  }
  return sum.norm(N_);
}

/// The norm of the error estimate solved with the matrix at the end of the step. Where stiffness ends within
/// the step, the matrix at the beginning is far too large and damps both stages and estimate. Returns 0 if
/// the estimate is visibly small, or the matrix unchanged, without solving.
double RosenbrockStepper::error_at_end(double dt) {
  const double gh = method_->gamma() * dt;
  if (!check_.is_visible(gh, at_end_.undamped.data(), at_end_.weights, entries_)) return 0;
  if (entries_at_ != here_.t) keep_jacobian(here_, entries_);
  keep_jacobian(next_, at_end_.entries);
  if (!jacobian_has_changed(gh) || !factorise_at_end(gh, at_end_.entries)) return 0;
  at_end_.solver.solve(at_end_.undamped.data());
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) sum.add(at_end_.undamped[k] / at_end_.weights[k]);
  const double norm = sum.norm(N_);
  return std::isfinite(norm) ? norm : 0;
}

/// Sets the tolerances of the step.
void RosenbrockStepper::set_weights() {
  for (int k = 0; k < N_; ++k)
    at_end_.weights[k] =
        weight(k, std::max(std::fabs(y_[k]), std::fabs(k < n() ? next_.x[k] : next_.z[k - n()])));
}

/// Factorises M/(γh) + J separately from the matrix of the stages.
bool RosenbrockStepper::factorise_at_end(double gh, const std::vector<double>& entries) {
  for (std::size_t k = 0; k < entries.size(); ++k)
    matrix_[k] = rows_.in_mass[k] ? entries[k] / gh : entries[k];
  ++stats_.factorisations;
  if (at_end_.solver.size() == 0) at_end_.solver.analyse(N_, rows_.positions);
  return at_end_.solver.factorise(matrix_.data());
}

void RosenbrockStepper::keep_jacobian(const Point& at, std::vector<double>& entries) {
  problem_->set_point(at.t, at.x.data(), at.xdot.data(), at.z.data());
  entries = problem_->jacobian();
  entries_at_ = at.t;
  ++stats_.jacobians;
}

/// Does J e, with e the estimated error, change along the step by more than the tolerances? In rows without
/// x′: by more than a tenth of their change within the tolerances.
bool RosenbrockStepper::jacobian_has_changed(double gh) {
  constexpr double tenth = 0.1;
  std::fill(R_.begin(), R_.end(), 0.0);
  std::fill(at_end_.bounds.begin(), at_end_.bounds.end(), 0.0);
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    const auto [row, column] = rows_.positions[k];
    if (rows_.in_mass[k]) {
      at_end_.bounds[row] += std::fabs(at_end_.entries[k]) * at_end_.weights[column] / gh;
      continue;
    }
    R_[row] += (at_end_.entries[k] - entries_[k]) * scaled_[column] * at_end_.weights[column];
    if (!rows_.in_mass_row[row])
      at_end_.bounds[row] += tenth * std::fabs(at_end_.entries[k]) * at_end_.weights[column];
  }
  for (std::size_t row = 0; row < R_.size(); ++row)
    if (!(std::fabs(R_[row]) <= at_end_.bounds[row])) return true;
  return false;
}

}  // namespace pendula::integrate
