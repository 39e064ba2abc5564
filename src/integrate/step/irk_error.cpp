// Error estimates of an implicit step, Radau IIA and others (docs/derivations.md#radau):
//
//   err = ((γ/h) M + J)⁻¹ F(t₀, y, v),  v = -Σ eᵢ Zᵢ/h          filtered_error(); e is IrkFormula::error
//
// with y = y₀; in the first step and after a rejection a second time with y = y₀ + err. Also in this file: an
// additional correction at the end of a step, and the undamped estimate for cases in which the matrix in
// front would hide the error (docs/derivations.md#step-checks).
#include <algorithm>
#include <array>
#include <cmath>

#include "integrate/solve/vector_sums.hpp"
#include "integrate/step/irk_stepper.hpp"

namespace pendula::integrate {

/// ‖((γ/h) M + J)⁻¹ F(t₀, y, v)‖ in units of the tolerances, with v = work_.velocity.
double IrkStepper::filtered_error(const double* y) {
  problem_->set_time(here_.t);
  double* at = problem_->unknowns();
  std::copy_n(y, n(), at);
  std::copy_n(work_.velocity.data(), n(), at + n());
  std::copy_n(y + n(), m(), at + 2 * n());
  problem_->residual(error_.data());
  ++stats_.evaluations;
  // Constraints in x alone are left out: their residual belongs to the beginning of the step, and divided by
  // h² it would dominate an index-3 multiplier in steps of any size.
  for (std::size_t k = 0; k < error_.size(); ++k) error_[k] = rows_.bare[k] ? 0 : -error_[k];
  matrices().real.solve(error_.data());
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) sum.add(error_[k] / scales_.scale[k]);
  return std::max(sum.norm(N_), least_error);
}

/// The distance, in tolerances, of a step to a point inside an accepted one from the continuous extension of
/// the latter; 0 unless it is farther than this has moved in all. No error estimate controls the inner step,
/// whose last stage may lie on a pole.
double IrkStepper::departure(const StepView& step, const Point& curve, const Point& inside) const {
  constexpr double several = 100;  // tolerances: the extension has a lower order
  double farthest = 0;
  for (int i = 0; i < n(); ++i) {
    const double distance = std::fabs(inside.x[i] - curve.x[i]);
    const double unit = weight(i, std::fabs(step.from.x[i]));
    if (!(distance <= std::fabs(step.to.x[i] - step.from.x[i]) + several * unit))
      farthest = std::max(farthest, distance / unit);
  }
  return farthest;
}

/// Waves that the stages of a step pass alike have errors beyond any estimate; smaller ones than `hidden`
/// are mostly of stiff components, which the next steps damp: the estimates have judged them.
double IrkStepper::error_by_doubling(const StepView& step) {
  constexpr double hidden = 20;  // tolerances
  const double middle = step.from.t + (step.to.t - step.from.t) / 2;
  StepView part = step;
  if (!inside().goes(part, middle) || !inside().goes(part, step.to.t)) return 0;
  double largest = 0;
  for (int i = 0; i < n(); ++i) {
    const double size = std::max(std::fabs(step.from.x[i]), std::fabs(step.to.x[i]));
    largest = std::max(largest, std::fabs(part.from.x[i] - step.to.x[i]) / weight(i, size));
  }
  return largest > hidden ? largest : 0;
}

/// Moves the beginning of the part to t, by one step or, where its iteration fails, by shorter ones.
bool IrkStepper::goes(StepView& part, double t) {
  const auto level = static_cast<int>(part.record[0]);
  double dt = t - part.from.t;
  constexpr int most = 16;  // attempts
  for (int k = 0; k < most; ++k) {
    const double next = part.from.t + dt < t ? part.from.t + dt : t;
    if (reaches(part, level, next)) {
      part.from = next_;
      part.from.t = next;
      if (next == t) return true;
    } else {
      dt /= 2;
    }
  }
  return false;
}

/// The error in tolerances. The matrix in front of the estimate damps it excessively if the matrix is
/// inaccurate or belongs to a fast growing solution; then the undamped estimate is used.
double IrkStepper::error_norm(double dt, bool again) {
  const double norm = damped_error_norm(dt, again);
  if (!(norm < 1) || check_.empty() || rounding_.has_multipliers()) return norm;
  return check_.undamped_norm(norm, error_.data(), f().gamma / dt, scales_.scale, jacobian_.entries);
}

/// The norm of an additional correction of the last stage with the Jacobian there. Where stiffness decreases
/// along the step, the Jacobian in use is far too large and makes corrections and error estimates tiny.
/// Computed in steps much longer than the last one, and where a residual is left that would be visible
/// without the matrix; otherwise 0.
double IrkStepper::correction_at_end(double dt) {
  constexpr double longer = 2;
  const bool due = determined_ && last_.dt > 0 && (iteration_.checks_due > 0 || dt > longer * last_.dt);
  const double gh = dt / f().gamma;
  const int last = f().s - 1;
  const double* Z = Z_.data() + static_cast<std::ptrdiff_t>(last) * N_;
  bool stagnates = false;
  if (check_.has_algebraic()) {
    const auto [F, stride] = last_residual();
    stagnates = check_.stagnates(F, stride);
    check_.set_first(F, stride);
  }
  if (!due && !stagnates && !(determined_ && check_.leaves_visible(gh, scales_.scale, jacobian_.entries)))
    return 0;
  double* at = problem_->unknowns();
  problem_->set_time(here_.t + f().c[last] * dt);
  for (int k = 0; k < N_; ++k) at[k < n() ? k : n() + k] = y_[k] + Z[k];
  for (int j = 0; j <= last; ++j) work_.weights[j] = f().W(last, j) / dt;
  combine(n(), nullptr, work_.weights, Z_.data(), N_, at + n());
  problem_->residual(error_.data());
  ++stats_.evaluations;
  stagnates = stagnates && check_.stagnates(error_.data(), 1);
  const bool visible = determined_ && check_.is_visible(gh, error_.data(), scales_.scale, jacobian_.entries);
  if (!due && !stagnates && !visible) return 0;
  const std::vector<double>& entries = problem_->jacobian();
  ++stats_.jacobians;
  for (int k = 0; k < N_; ++k) work_.transformed[k] = y_[k] + Z[k];
  if (stagnates && !check_.stagnates(error_.data(), work_.transformed.data(), entries)) {
    check_.set_harmless(error_.data(), work_.transformed.data(), entries);
    stagnates = false;
    if (!due && !visible) return 0;
  }
  if (!factorise_apart(entries, gh)) return 0;
  std::copy_n(error_.begin(), N_, work_.residual.begin());
  jacobian_.end.solve(error_.data());
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) sum.add(error_[k] / scales_.scale[k]);
  const double norm = sum.norm(N_);
  if (stagnates && norm < 1) check_.set_harmless(work_.residual.data(), work_.transformed.data(), entries);
  constexpr int steps_checked = 4;  // steps until a large correction is forgotten
  constexpr double small = 0.1;     // correction, in tolerances
  if (norm >= 1)
    iteration_.checks_due = steps_checked;
  else if (norm < small && iteration_.checks_due > 0)
    --iteration_.checks_due;
  return std::isfinite(norm) ? norm : 0;
}

/// Factorises M/gh + J separately from the matrices of the iteration.
bool IrkStepper::factorise_apart(const std::vector<double>& entries, double gh) {
  for (std::size_t k = 0; k < entries.size(); ++k)
    shifted_.real[k] = rows_.in_mass[k] ? entries[k] / gh : entries[k];
  ++stats_.factorisations;
  if (jacobian_.end.size() == 0) jacobian_.end.analyse(N_, rows_.positions);
  return jacobian_.end.factorise(shifted_.real.data());
}

/// The error of stiff components at the end of a step by a method with |R(∞)| = 1, such as Gauss. Such
/// methods do not damp it, and the embedded estimate does not contain it. The equations determine these
/// components from the others, and the distance from that value is (γ/h M + J)⁻¹ F(t₁, y₁, v), v the slope of
/// the collocation polynomial at the end (work_.velocity). Without stiffness, a distance of many tolerances
/// is due to a pulse at the end, where such a method has no stage.
double IrkStepper::stiff_error_at_end(double dt) {
  constexpr double stiff = 0.3;   // relative to the distance without the matrix
  constexpr double pulse = 0.02;  // 50 tolerances; both estimates are of order s + 1
  if (f().stiffly_accurate || !determined_ || rounding_.has_multipliers()) return 0;
  ErrorSum without;
  for (int k = 0; k < n(); ++k)
    without.add((next_.xdot[k] - work_.velocity[k]) * dt / f().gamma / scales_.scale[k]);
  const double undamped = without.norm(N_);
  if (!(stiff * undamped >= 1)) return 0;
  if (matrices().code) {  // the compiled step keeps its own factors
    shift(f().gamma / dt);
    if (!matrices().real.factorise(shifted_.real.data())) return 0;
  }
  problem_->set_point(next_.t, next_.x.data(), work_.velocity.data(), next_.z.data());
  problem_->residual(error_.data());
  ++stats_.evaluations;
  matrices().real.solve(error_.data());
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) sum.add(error_[k] / scales_.scale[k]);
  const double norm = sum.norm(N_);
  if (!(norm < stiff * undamped)) return pulse * norm;
  if (norm < 1) release_stiff_error(dt);
  return norm;
}

/// Subtracts the stiff part of the error found by stiff_error_at_end(). Even below the tolerance, errors of
/// ±δ in every step act on the other components by δ² if the equations are nonlinear. ((γ/h M + J)⁻¹ J)ᵏ
/// preserves stiff components and reduces the others to (hλ/γ)ᵏ of their size, beyond the order of the
/// method; it keeps linear invariants.
void IrkStepper::release_stiff_error(double dt) {
  constexpr int powers = 3;
  if (problem_->projects()) return;
  std::vector<double>& slow = work_.transformed;
  for (int p = 0; p < powers; ++p) {
    std::fill_n(slow.begin(), N_, 0.0);
    for (std::size_t k = 0; k < jacobian_.entries.size(); ++k) {
      const Position& at = rows_.positions[k];
      if (rows_.in_mass[k]) slow[at.row] += f().gamma / dt * jacobian_.entries[k] * error_[at.column];
    }
    matrices().real.solve(slow.data());
    add_multiple(error_.data(), -1, slow.data(), N_);
  }
  const Point before = next_;
  for (int k = 0; k < n(); ++k) next_.x[k] -= error_[k];
  if (!rhs_(next_.t, next_.x.data(), next_.xdot.data(), next_.z.data())) next_ = before;
}

/// The error by the decay of the collocation polynomial in Legendre's: where its coefficients fall by q from
/// one degree to the next, the ends, of order 2 s - 1, err by qˢ of the last ones. The estimate of formulas
/// with many stages, of order s and in tolerances that are looser by the difference of the orders, is far too
/// small where the series does not converge (docs/derivations.md#step-checks).
double IrkStepper::unresolved(double dt) {
  constexpr int many = 5;
  constexpr double bent = 0.02;  // contraction, by what the Jacobian changes in the step
  const int s = f().s;
  if (s < many || !f().stiffly_accurate || (iteration_.theta < bent && !driven_)) return 0;
  const auto unit = [this](int k) { return weight(k, std::max(std::fabs(y_[k]), std::fabs(next_.x[k]))); };
  Vec slope;  // that the step has missed
  bool visible = false;
  for (int k = 0; k < n(); ++k) {
    std::array<double, IrkFormula::most_last_degrees> c{};
    for (int i = 0; i < s; ++i)
      for (std::size_t r = 0; r < c.size(); ++r) c[r] += f().last_degrees(r, i) * Z_[i * N_ + k];
    const double last = std::max(std::fabs(c[0]), std::fabs(c[1]));
    if (last <= unit(k)) continue;
    const double before = std::max(std::fabs(c[2]), std::fabs(c[3]));
    double error = last;  // (c/b)^(s/2), s being odd
    if (const double quotient = last / before; quotient < 1) {
      error *= std::sqrt(quotient);
      for (int j = 0; j < s / 2; ++j) error *= quotient;
    }
    if (slope.size() == 0) slope.setZero(n());
    slope[k] = std::copysign(error, c[0]) / dt;
    visible = visible || error > unit(k);
  }
  if (!visible || !filter_missed(dt, slope, error_)) return 0;  // stiff components are not missed
  double largest = 0;
  for (int k = 0; k < n(); ++k) largest = std::max(largest, std::fabs(error_[k]) / unit(k));
  return largest;
}

double IrkStepper::damped_error_norm(double dt, bool again) {
  if (CompiledNewtonStep* code = matrices().code.get()) return damped_error_norm(*code, again);
  const auto size = static_cast<std::size_t>(N_);
  std::fill_n(work_.velocity.data(), n(), 0.0);
  for (int i = 0; i < f().s; ++i)
    add_multiple(work_.velocity.data(), -f().error[i] / dt, Z_.data() + static_cast<std::size_t>(i) * size,
                 n());
  double norm = filtered_error(y_.data());
  if (norm < 1 || !again) return norm;
  // The first estimate of a very stiff component is too large; it is repeated from y₀ + err.
  std::vector<double>& moved = work_.transformed;
  for (std::size_t k = 0; k < size; ++k) moved[k] = y_[k] + error_[k];
  const double second = filtered_error(moved.data());
  return std::isfinite(second) ? second : norm;
}

double IrkStepper::damped_error_norm(CompiledNewtonStep& code, bool again) {
  const auto norm = [&](const CompiledNewtonStep::End& end) {
    ++stats_.evaluations;
    error_.assign(end.error, end.error + N_);
    return std::max(ErrorSum::norm(end.sum, end.largest, N_), least_error);
  };
  const double first = norm(end_ = code.end());
  if (first < 1 || !again) return first;
  std::vector<double>& moved = work_.transformed;
  for (std::size_t k = 0; k < static_cast<std::size_t>(N_); ++k) moved[k] = y_[k] + error_[k];
  const double second = norm(code.end_at(moved.data()));
  end_ = code.end();
  return std::isfinite(second) ? second : first;
}

/// Another one, which does not forget what this one does.
IrkStepper& IrkStepper::inside() {
  if (!last_.inside)
    last_.inside = std::make_shared<IrkStepper>(name_, problem_, formulas_, index_, tolerances_, limits_,
                                                last_.inside_stats);
  last_.inside->determined_ = determined_;
  return *last_.inside;
}

}  // namespace pendula::integrate
