// Looks between the stages of an implicit step (pulse_watch.hpp).
#include <algorithm>
#include <cmath>
#include <limits>

#include "integrate/step/irk_stepper.hpp"

namespace pendula::integrate {

/// The collocation polynomial at this part of the step: its value and the slope of x.
void IrkStepper::polynomial(double part, double dt, double* value, double* slope) const {
  const auto& c = f().c;
  std::copy_n(y_.data(), N_, value);
  std::fill_n(slope, n(), 0.0);
  for (int i = 0; i < f().s; ++i) {
    double l = part / c[i],
           derivative = 1 / part;  // of the polynomial that is 1 at cᵢ, 0 at 0 and the others
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

/// Of z in units of a tenth of its swing, of x in tolerances: the larger of the two.
double IrkStepper::missed_between_stages(double dt) {
  constexpr int looks = 5;
  if (!determined_ || m() == 0 || rhs_.is_linear()) return 0;
  pulses_.begin(here_.z, next_.z);
  for (std::size_t first = static_cast<std::size_t>(n()); first < Z_.size();
       first += static_cast<std::size_t>(N_)) {
    for (int k = 0; k < m(); ++k) work_.transformed[k] = y_[n() + k] + Z_[first + k];
    pulses_.include(work_.transformed.data());
  }
  if (!pulses_.is_due(scales_.scale)) return 0;
  const auto curve = [this, dt](double part, double* y, double* slope) { polynomial(part, dt, y, slope); };
  const PulseWatch::Step step{here_.t, dt, f().c, looks, curve, scales_.scale};
  const double z = pulses_.look(step, rhs_, tolerances_.rtol.minCoeff());
  return std::max(z, missed_norm(dt, pulses_.missed()));
}

/// ‖((γ/h) M + J)⁻¹ γ M δ‖, δ = missed; no more than ‖h δ‖ where nothing grows in a step.
double IrkStepper::missed_norm(double dt, const Vec& missed) {
  const auto norm = [this](double factor, const double* v) {
    ErrorSum sum;
    for (int k = 0; k < n(); ++k) sum.add(factor * v[k] / scales_.scale[k]);
    return sum.norm(N_);
  };
  if (norm(dt, missed.data()) < 1) return 0;
  if (matrices().code) {  // it has factors of its own
    shift(f().gamma / dt);
    if (!matrices().real.factorise(shifted_.real.data())) return 0;
  }
  std::fill(error_.begin(), error_.end(), 0.0);
  for (std::size_t k = 0; k < jacobian_.entries.size(); ++k) {
    const Position& at = rows_.positions[k];
    if (rows_.in_mass[k]) error_[at.row] += f().gamma * jacobian_.entries[k] * missed[at.column];
  }
  matrices().real.solve(error_.data());
  const double filtered = norm(1, error_.data());
  return std::isfinite(filtered) ? filtered : std::numeric_limits<double>::max();
}

}  // namespace pendula::integrate
