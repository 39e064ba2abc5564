// Inspection of a Rosenbrock step between its ends (pulse_watch.hpp), since its stages do not
// solve the equations.
#include <algorithm>
#include <array>

#include "integrate/step/rosenbrock_stepper.hpp"

namespace pendula::integrate {

/// Evaluates the continuous extension of a record, (y₀, y₁, K₁ …), at a share of the step: its value, and the
/// slope of x.
void RosenbrockStepper::curve(const double* dense, double part, double dt, double* y, double* slope) const {
  const double u = part, v = 1 - u;
  const auto rows = method_->dense().rows();
  for (int k = 0; k < N_; ++k) {
    double inner = 0, derivative = 0;  // K₁ + θ(K₂ + …)
    for (Eigen::Index r = rows; r-- > 0;) {
      derivative = inner + u * derivative;
      inner = dense[(2 + r) * N_ + k] + u * inner;
    }
    const double y0 = dense[k], y1 = dense[N_ + k];
    y[k] = v * y0 + u * (y1 + v * inner);
    if (k < n()) slope[k] = (y1 - y0 + (v - u) * inner + u * v * derivative) / dt;
  }
}

/// The motion missed inside the step: the larger of z in tenths of its range and x in tolerances, filtered
/// like the error estimate.
double RosenbrockStepper::missed_on_the_way(double dt) {
  constexpr int samples = 7;
  constexpr std::array<double, 1> end = {1};
  if (m() == 0 || rhs_.is_linear()) return 0;
  const auto on_curve = [this, dt](double part, double* y, double* slope) {
    curve(last_.dense.data(), part, dt, y, slope);
  };
  pulses_.begin(here_.z, next_.z);
  for (const double part : {0.25, 0.5, 0.75}) {
    on_curve(part, U_.data(), R_.data());
    pulses_.include(U_.data() + n());
  }
  if (!pulses_.is_due(at_end_.weights)) return 0;
  const PulseWatch::Step step{here_.t, dt, end, samples, on_curve, at_end_.weights};
  const double z =
      pulses_.distance_from_equations(step, [this](double t, const double* y, Vec& xdot, Vec& z_there) {
        return rhs_.stage(t, y, xdot.data(), z_there.data(), tolerances_.rtol.minCoeff());
      });
  return std::max(z, pulses_.missed_norm(dt, at_end_.weights, [&](const Vec& missed, std::vector<double>& e) {
    return filter_missed(dt, missed, e);
  }));
}

/// e = (M/(γh) + J)⁻¹ M δ/γ, δ = missed.
bool RosenbrockStepper::filter_missed(double dt, const Vec& missed, std::vector<double>& e) {
  if (entries_at_ != here_.t) keep_jacobian(here_, entries_);
  if (!factorise_at_end(method_->gamma() * dt, entries_)) return false;
  std::fill(e.begin(), e.end(), 0.0);
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    const Position& at = rows_.positions[k];
    if (rows_.in_mass[k]) e[at.row] += entries_[k] * missed[at.column] / method_->gamma();
  }
  at_end_.solver.solve(e.data());
  return true;
}

}  // namespace pendula::integrate
