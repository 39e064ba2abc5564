// The Newton iterations of an implicit step: Jacobian, factorisations, starting values, stages, error
// estimate.
#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "integrate/solve/vector_sums.hpp"
#include "integrate/step/irk_stepper.hpp"

namespace pendula::integrate {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

}  // namespace

bool IrkStepper::evaluate_jacobian() {
  problem_->place(here_.t, here_.x.data(), here_.xdot.data(), here_.z.data());
  entries_ = problem_->jacobian();
  ++stats_.jacobians;
  jacobian_fresh_ = true;
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    if (std::isfinite(entries_[k])) continue;
    trouble_ = text("the Jacobian of ", problem_->equation_name(positions_[k].row), " is not finite");
    return false;
  }
  return true;
}

/// The step as straight-line code with the pivots at hand; false: no code, or the pivots do not suit all its
/// matrices.
bool IrkStepper::use_code(double dt, bool now) {
  const codegen::StraightLU* pivots = matrices().real.straight();
  if (!pivots) return false;
  const long iterations = stats_.newton_iterations - iterations_counted_;
  iterations_counted_ = stats_.newton_iterations;
  matrices().code = NewtonCode::make({*problem_, f(), bare_, in_mass_, *pivots}, iterations, now);
  if (matrices().code && !matrices().code->factorise(entries_, dt)) matrices().code = nullptr;
  return matrices().code != nullptr;
}

/// Code for the first formula, with the Jacobian at the start.
void IrkStepper::prepare_code() {
  constexpr int small = 60;
  if (N_ > small || matrices().code || !evaluate_jacobian()) return;
  shift(f().gamma / dt_);
  matrices().real.prepare(real_entries_.data());
  if (matrices().real.factorise(real_entries_.data())) use_code(dt_, true);
  trouble_.clear();
}

void IrkStepper::shift(double factor) {
  for (std::size_t k = 0; k < entries_.size(); ++k)
    real_entries_[k] = in_mass_[k] ? factor * entries_[k] : entries_[k];
}
void IrkStepper::shift(std::complex<double> factor) {
  for (std::size_t k = 0; k < entries_.size(); ++k)
    complex_entries_[k] = in_mass_[k] ? factor * entries_[k] : entries_[k];
}

bool IrkStepper::factorise(double dt) {
  ++stats_.factorisations;
  NewtonCode* code = matrices().code.get();
  bool regular = code && code->factorise(entries_, dt);
  if (!regular) {
    matrices().code = nullptr;
    shift(f().gamma / dt);
    regular = matrices().real.factorise(real_entries_.data()) && (use_code(dt, false) || factorise_pairs(dt));
  }
  factorised_for_ = regular ? dt : 0;
  if (!regular) trouble_ = "the iteration matrix is singular";
  return regular;
}

bool IrkStepper::factorise_pairs(double dt) {
  bool regular = true;
  for (std::size_t pair = 0; regular && pair < f().pairs.size(); ++pair) {
    shift(f().pairs[pair] / dt);
    regular = matrices().complex[pair].factorise(complex_entries_.data());
  }
  return regular;
}

void IrkStepper::start_iteration(double dt) {
  NewtonCode* code = matrices().code.get();
  if (code) code->begin(*problem_, here_.t, dt, y_.data(), scale_.data());
  if (code && old_dt_ > 0 && old_level_ == level_) {
    code->predict(dt / old_dt_, step_y_.data(), old_Z_.data());
    return;
  }
  predict(dt);
  if (code) code->set(Z_.data());
}

/// Starting values of Z: the collocation polynomial of the last step continued.
void IrkStepper::predict(double dt) {
  const auto size = static_cast<std::size_t>(N_);
  if (old_dt_ == 0) {
    std::fill(Z_.begin(), Z_.end(), 0.0);
    for (int i = 0; i < f().s; ++i)  // equations that are not linear in x′ need x′ to begin with
      for (int k = 0; k < n(); ++k)
        Z_[static_cast<std::size_t>(i) * size + static_cast<std::size_t>(k)] = f().c[i] * dt * here_.xdot[k];
    return;
  }
  // The Lagrange polynomials add up to 1: p(θ) - y₀ = Σ lⱼ(θ) Zⱼ - (y₀ - its value at the old start).
  const IrkFormula& old = *formulas_[old_level_];
  lagrange_.resize(static_cast<std::size_t>(old.s) + 1);
  for (int i = 0; i < f().s; ++i) {
    old.lagrange(1 + f().c[i] * dt / old_dt_, lagrange_.data());
    double* Zi = Z_.data() + static_cast<std::size_t>(i) * size;
    for (std::size_t k = 0; k < size; ++k) Zi[k] = step_y_[k] - y_[k];
    combine(N_, Zi, std::span<const double>(lagrange_).subspan(1, static_cast<std::size_t>(old.s)),
            old_Z_.data(), N_, Zi);
  }
}

/// R_i = F(tᵢ, y₀ + Zᵢ, (W Z)ᵢ/h); false if not finite.
bool IrkStepper::residuals(double dt) {
  const int s = f().s, states = n();
  const auto size = static_cast<std::size_t>(N_);
  for (int i = 0; i < s; ++i) {
    problem_->set_time(here_.t + f().c[i] * dt);
    double* at = problem_->unknowns();
    const double* Zi = Z_.data() + static_cast<std::size_t>(i) * size;
    for (int k = 0; k < states; ++k) at[k] = y_[k] + Zi[k];
    for (int j = 0; j < s; ++j) weights_[j] = f().W(i, j) / dt;
    combine(states, nullptr, weights_, Z_.data(), N_, at + states);
    for (int k = states; k < N_; ++k) at[states + k] = y_[k] + Zi[k];
    double* R = R_.data() + static_cast<std::size_t>(i) * size;
    problem_->residual(R);
    ++stats_.evaluations;
    double sum = 0;
    for (std::size_t k = 0; k < size; ++k) sum += R[k] * 0;
    if (sum == 0) continue;
    for (std::size_t k = 0; k < size; ++k)
      if (!std::isfinite(R[k]))
        trouble_ = text(problem_->equation_name(static_cast<int>(k)), " is not finite");
    return false;
  }
  return true;
}

/// R ← ΔZ, the solution of ((W ⊗ M)/h + I ⊗ J) ΔZ = -R.
void IrkStepper::solve_stages() {
  const int s = f().s;
  const auto size = static_cast<std::size_t>(N_);
  const auto mix = [&](const Mat& by, const std::vector<double>& from, std::vector<double>& to) {
    for (int i = 0; i < s; ++i) {
      for (int j = 0; j < s; ++j) weights_[j] = by(i, j);
      combine(N_, nullptr, weights_, from.data(), N_, to.data() + static_cast<std::size_t>(i) * size);
    }
  };
  mix(f().T_inverse, R_, transformed_);
  double* w = transformed_.data();
  if (f().has_real) {
    for (std::size_t k = 0; k < size; ++k) w[k] = -w[k];
    matrices().real.solve(w);
    w += size;
  }
  for (LinearSolver<std::complex<double>>& solver : matrices().complex) {
    for (std::size_t k = 0; k < size; ++k) complex_right_[k] = {-w[k], w[size + k]};
    solver.solve(complex_right_.data());
    for (std::size_t k = 0; k < size; ++k)
      w[k] = complex_right_[k].real(), w[size + k] = -complex_right_[k].imag();
    w += 2 * size;
  }
  mix(f().T, transformed_, R_);
}

/// Z ← Z + ΔZ; ‖ΔZ‖, NaN where an equation is not finite.
double IrkStepper::iterate(double dt) {
  const auto size = static_cast<std::size_t>(N_);
  if (!residuals(dt)) return NAN;
  solve_stages();
  ++stats_.newton_iterations;
  double sum = 0, largest = 0;
  for (std::size_t at = 0; at < Z_.size(); at += size)
    apply(N_, Z_.data() + at, R_.data() + at, inverse_scale_.data(), sum, largest);
  return ErrorSum::norm(sum, largest, f().s * N_);
}

double IrkStepper::iterate(NewtonCode& code) {
  double sum = 0, largest = 0;
  stats_.evaluations += f().s;
  ++stats_.newton_iterations;
  code.iterate(sum, largest);
  const double length = ErrorSum::norm(sum, largest, f().s * N_);
  if (!std::isfinite(length)) trouble_ = "the equations are not finite at a stage of the step";
  return length;
}

IrkStepper::Newton IrkStepper::newton(double dt) {
  const int most = 7 + (f().s - 3) * 5 / 2;
  double before = 0, quotient_before = 0;
  contraction_ = std::pow(static_cast<float>(std::max(contraction_, eps)), 0.8f);
  theta_ = keep_jacobian_below;
  NewtonCode* code = matrices().code.get();
  for (iterations_ = 1;; ++iterations_) {
    const double length = code ? iterate(*code) : iterate(dt);
    if (!std::isfinite(length)) return Newton::not_finite;
    last_length_ = length;
    if (iterations_ > 1) {
      const double quotient = length / before;
      theta_ = iterations_ == 2 ? quotient : std::sqrt(quotient * quotient_before);
      quotient_before = quotient;
      if (!(theta_ < 0.99)) return Newton::diverged;
      contraction_ = theta_ / (1 - theta_);
      const int left = most - 1 - iterations_;
      double predicted = contraction_ * length / newton_tolerance_;
      for (int k = 0; k < left && predicted >= 1; ++k) predicted *= theta_;
      if (predicted >= 1 && iterations_ < most) {
        slow_factor_ = 0.8 * std::pow(std::clamp(predicted, 1e-4, 20.0), -1.0 / (4 + left));
        return Newton::slow;
      }
    }
    before = std::max(length, eps);
    // One iteration tells nothing about its own contraction: far away, that of the last step is not trusted.
    const bool measured = iterations_ > 1 || length <= 1;
    if (measured && contraction_ * length <= newton_tolerance_) return Newton::converged;
    if (iterations_ >= most) return Newton::diverged;
  }
}

/// Were the last corrections of an iteration that did not converge, or the error that was too large,
/// rounding?
RoundingFloor::Answer IrkStepper::at_rounding(double dt, double length) {
  constexpr double stages = 100;  // what transformations and sums over the stages make of it; seen: 4 … 45
  if (matrices().code) {          // it has factors of its own
    shift(f().gamma / dt);
    if (!matrices().real.factorise(real_entries_.data())) return RoundingFloor::Answer::no;
  }
  const auto solve = [&](double* right) { matrices().real.solve(right); };
  const auto answer = rounding_.look({positions_, entries_, in_mass_, solve}, y_.data(), here_.xdot.data(),
                                     scale_, dt, length, stages);
  if (rounding_.trouble > 0) trouble_ = rounding_text(rounding_, unknown_name(rounding_.worst));
  if (answer != RoundingFloor::Answer::accepted) return answer;
  newton_tolerance_ = std::max(newton_tolerance_, std::min(0.1, stages / 10 * rounding_.floor));
  theta_ = 10 * keep_jacobian_below;  // not measured: new Jacobian, same order
  return answer;
}

/// ‖(γ/h M + J)⁻¹ F(t₀, y, v)‖ with x′ = velocity_.
double IrkStepper::filtered_error(const double* y, double) {
  problem_->set_time(here_.t);
  double* at = problem_->unknowns();
  std::copy_n(y, n(), at);
  std::copy_n(velocity_.data(), n(), at + n());
  std::copy_n(y + n(), m(), at + 2 * n());
  problem_->residual(error_.data());
  ++stats_.evaluations;
  // The residual of a constraint in x alone belongs to the point the step begins at, and h⁻² of it would be
  // seen in an index-3 multiplier however small the step.
  for (std::size_t k = 0; k < error_.size(); ++k) error_[k] = bare_[k] ? 0 : -error_[k];
  matrices().real.solve(error_.data());
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) sum.add(error_[k] / scale_[k]);
  return std::max(sum.norm(N_), 1e-10);
}

double IrkStepper::error_norm(double dt, bool again) {
  if (NewtonCode* code = matrices().code.get()) return error_norm(*code, again);
  const auto size = static_cast<std::size_t>(N_);
  std::fill_n(velocity_.data(), n(), 0.0);
  for (int i = 0; i < f().s; ++i)
    add_multiple(velocity_.data(), -f().error[i] / dt, Z_.data() + static_cast<std::size_t>(i) * size, n());
  double norm = filtered_error(y_.data(), dt);
  if (norm < 1 || !again) return norm;
  // The first estimate of a very stiff component is too large: once more from y₀ + err.
  std::vector<double>& moved = transformed_;
  for (std::size_t k = 0; k < size; ++k) moved[k] = y_[k] + error_[k];
  const double second = filtered_error(moved.data(), dt);
  return std::isfinite(second) ? second : norm;
}

double IrkStepper::error_norm(NewtonCode& code, bool again) {
  const auto norm = [&](const NewtonCode::End& end) {
    ++stats_.evaluations;
    error_.assign(end.error, end.error + N_);
    return std::max(ErrorSum::norm(end.sum, end.largest, N_), 1e-10);
  };
  const double first = norm(end_ = code.end());
  if (first < 1 || !again) return first;
  std::vector<double>& moved = transformed_;
  for (std::size_t k = 0; k < static_cast<std::size_t>(N_); ++k) moved[k] = y_[k] + error_[k];
  const double second = norm(code.end_at(moved.data()));
  end_ = code.end();
  return std::isfinite(second) ? second : first;
}

}  // namespace pendula::integrate
