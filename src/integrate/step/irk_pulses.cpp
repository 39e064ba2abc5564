// Inspection of an implicit step between its stages (pulse_watch.hpp).
#include <algorithm>

#include "integrate/step/irk_stepper.hpp"

namespace pendula::integrate {

/// Evaluates the collocation polynomial at a share of the step: its value, and the slope of x.
void IrkStepper::polynomial(double part, double dt, double* value, double* slope) const {
  const auto& c = f().c;
  std::copy_n(y_.data(), N_, value);
  std::fill_n(slope, n(), 0.0);
  for (int i = 0; i < f().s; ++i) {
    double l = part / c[i],
           derivative = 1 / part;  // of the polynomial that is 1 at cᵢ and 0 at 0 and at the other nodes
    for (int j = 0; j < f().s; ++j) {
      if (j == i) continue;
      l *= (part - c[j]) / (c[i] - c[j]);
      derivative += 1 / (part - c[j]);
    }
    const double* Z = Z_.data() + static_cast<std::ptrdiff_t>(i) * N_;
    add_multiple(value, l, Z, N_);
    add_multiple(slope, l * derivative / dt, Z, n());
  }
}

/// The motion missed between the stages: the larger of z in tenths of its range and x in tolerances.
double IrkStepper::missed_between_stages(double dt) {
  constexpr int samples = 5;
  if (m() == 0 || rhs_.is_linear()) return 0;
  pulses_.begin(here_.z, next_.z);
  for (std::size_t first = static_cast<std::size_t>(n()); first < Z_.size();
       first += static_cast<std::size_t>(N_)) {
    for (int k = 0; k < m(); ++k) work_.transformed[k] = y_[n() + k] + Z_[first + k];
    pulses_.include(work_.transformed.data());
  }
  if (!pulses_.is_due(scales_.scale)) return 0;
  const auto curve = [this, dt](double part, double* y, double* slope) { polynomial(part, dt, y, slope); };
  const PulseWatch::Step step{here_.t, dt, f().c, samples, curve, scales_.scale};
  const double z =
      pulses_.distance_from_equations(step, [this, dt](double t, const double* y, Vec& xdot, Vec& z_there) {
        if (!determined_) return corrected_there(t, dt, y, xdot, z_there);
        return rhs_.stage(t, y, xdot.data(), z_there.data(), tolerances_.rtol.minCoeff());
      });
  return std::max(z, pulses_.missed_norm(dt, scales_.scale, [&](const Vec& missed, std::vector<double>& e) {
    return filter_missed(dt, missed, e);
  }));
}

/// For equations that do not determine x′ and z from (t, x): one correction of (x, z) as in the iteration,
/// ((γ/h) M + J)⁻¹ F with the Jacobian at that point; false if it does not reduce the residual. Constraints
/// in x alone hold at the stages only and are left out.
bool IrkStepper::corrected_there(double t, double dt, const double* y, Vec& xdot, Vec& z) {
  const double gh = dt / f().gamma;
  const auto residual = [&](const double* x) {
    problem_->set_point(t, x, xdot.data(), z.data());
    problem_->residual(error_.data());
    ++stats_.evaluations;
    for (std::size_t k = 0; k < error_.size(); ++k)
      if (rows_.bare[k]) error_[k] = 0;
  };
  residual(y);
  check_.set_first(error_.data(), 1);
  const std::vector<double> entries = problem_->jacobian();
  ++stats_.jacobians;
  if (!factorise_apart(entries, gh)) return false;
  std::vector<double>& corrected = work_.transformed;
  jacobian_.end.solve(error_.data());
  for (int k = 0; k < N_; ++k) corrected[k] = (k < n() ? y[k] : z[k - n()]) - error_[k];
  xdot -= Eigen::Map<const Vec>(error_.data(), n()) / gh;
  z = Eigen::Map<const Vec>(corrected.data() + n(), m());
  if (!xdot.allFinite() || !z.allFinite()) return false;
  residual(corrected.data());
  return !check_.stagnates(error_.data(), corrected.data(), entries);
}

/// e = ((γ/h) M + J)⁻¹ γ M δ, δ = missed.
bool IrkStepper::filter_missed(double dt, const Vec& missed, std::vector<double>& e) {
  if (matrices().code) {  // the compiled step keeps its own factors
    shift(f().gamma / dt);
    if (!matrices().real.factorise(shifted_.real.data())) return false;
  }
  std::fill(e.begin(), e.end(), 0.0);
  for (std::size_t k = 0; k < jacobian_.entries.size(); ++k) {
    const Position& at = rows_.positions[k];
    if (rows_.in_mass[k]) e[at.row] += f().gamma * jacobian_.entries[k] * missed[at.column];
  }
  matrices().real.solve(e.data());
  return true;
}

}  // namespace pendula::integrate
