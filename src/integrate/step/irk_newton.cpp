// Newton's iteration of an implicit step: Jacobian, factorisations, starting values, stages.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/epsilon.hpp"
#include "base/text.hpp"
#include "integrate/solve/vector_sums.hpp"
#include "integrate/step/irk_stepper.hpp"

namespace pendula::integrate {

/// The last stage of a step of this size, as predicted by the starting values.
Point IrkStepper::expected_end(double dt) {
  predict(dt, degree_continued(dt));
  const double* end = Z_.data() + Z_.size() - static_cast<std::size_t>(N_);
  Point there = here_;
  there.t += f().c.back() * dt;
  there.x += Eigen::Map<const Vec>(end, n());
  there.z += Eigen::Map<const Vec>(end + n(), m());
  return there;
}

bool IrkStepper::evaluate_jacobian(double ahead) {
  jacobian_.entries.swap(jacobian_.before);
  jacobian_.fresh = true;
  int row = -1;  // row of an infinite entry
  const auto take = [&](const Point& at) {
    problem_->set_point(at.t, at.x.data(), at.xdot.data(), at.z.data());
    jacobian_.entries = problem_->jacobian();
    ++stats_.jacobians;
    const auto infinite = std::find_if_not(jacobian_.entries.begin(), jacobian_.entries.end(),
                                           [](double e) { return std::isfinite(e); });
    if (infinite == jacobian_.entries.end()) return true;
    row = (rows_.positions.begin() + (infinite - jacobian_.entries.begin()))->row;
    return false;
  };
  if (take(ahead > 0 ? expected_end(ahead) : here_) || take_beside(take)) return true;
  trouble_ = text("the Jacobian of ", problem_->equation_name(row), " is not finite");
  jacobian_.entries.swap(jacobian_.before);
  return jacobian_.entries.size() == rows_.positions.size();
}

/// Compiles the step with the present pivots. False if there is no code or the pivots do not
/// suit all matrices.
bool IrkStepper::use_code(double dt, bool now) {
  const codegen::StraightLU* pivots = matrices().real.straight();
  if (!pivots) return false;
  const long iterations = stats_.newton_iterations - iteration_.counted;
  iteration_.counted = stats_.newton_iterations;
  matrices().code =
      CompiledNewtonStep::make({*problem_, f(), rows_.bare, rows_.in_mass, *pivots}, iterations, now);
  if (matrices().code && !matrices().code->factorise(jacobian_.entries, dt)) matrices().code = nullptr;
  return matrices().code != nullptr;
}

/// Compiles code for the first formula, with the Jacobian at the start.
void IrkStepper::prepare_code() {
  constexpr int small = 60;  // unknowns up to which code always pays (linear_solver.cpp)
  if (N_ > small || matrices().code || !evaluate_jacobian()) return;
  shift(f().gamma / dt_);
  matrices().real.prepare(shifted_.real.data());
  if (matrices().real.factorise(shifted_.real.data())) use_code(dt_, true);
  trouble_.clear();
}

void IrkStepper::shift(double factor) {
  for (std::size_t k = 0; k < jacobian_.entries.size(); ++k)
    shifted_.real[k] = rows_.in_mass[k] ? factor * jacobian_.entries[k] : jacobian_.entries[k];
}
void IrkStepper::shift(std::complex<double> factor) {
  for (std::size_t k = 0; k < jacobian_.entries.size(); ++k)
    shifted_.complex[k] = rows_.in_mass[k] ? factor * jacobian_.entries[k] : jacobian_.entries[k];
}

bool IrkStepper::factorise(double dt) {
  ++stats_.factorisations;
  CompiledNewtonStep* code = matrices().code.get();
  bool regular = code && code->factorise(jacobian_.entries, dt);
  if (!regular) {
    matrices().code = nullptr;
    shift(f().gamma / dt);
    regular = matrices().real.factorise(shifted_.real.data()) && (use_code(dt, false) || factorise_pairs(dt));
  }
  jacobian_.factorised_for = regular ? dt : 0;
  if (!regular) trouble_ = "the iteration matrix is singular";
  return regular;
}

bool IrkStepper::factorise_pairs(double dt) {
  bool regular = true;
  while (matrices().complex.size() < f().pairs.size())  // compiled steps need none
    matrices().complex.emplace_back().analyse(N_, rows_.positions);
  for (std::size_t pair = 0; regular && pair < f().pairs.size(); ++pair) {
    shift(f().pairs[pair] / dt);
    regular = matrices().complex[pair].factorise(shifted_.complex.data());
  }
  return regular;
}

/// The degree of the polynomial that continues the last step. Extrapolation multiplies the errors of
/// Newton's iteration by Σ |lⱼ|, for seven stages and fivefold growth of the step by 10⁷. After a failure,
/// following an iteration that began farther away than the step is long or with another Jacobian, the
/// largest tolerable degree is used for some steps; 0 means none. Equations without x′ whose Jacobian is
/// constant tolerate any starting value; the others then start from the last point, so that runs can
/// approach a singularity closely.
int IrkStepper::degree_continued(double dt) {
  constexpr double far = 300;  // tolerances; measured: 100 and 1000 are as good, 10 costs a tenth more
  if (last_.dt == 0 || last_.distrusted) return 0;
  const IrkFormula& old = *formulas_[last_.level];
  const double ratio = dt / last_.dt, theta = 1 + f().c.back() * ratio;
  const double tolerable_error = std::min(last_.distance * ratio, far);
  Prediction& past = iteration_.prediction;
  past.tolerable_error = 0;
  const bool suspicious = check_.has_algebraic() && (last_.repeated || control_.repeated);
  if (!suspicious && past.suspect_steps == 0) {
    past.tolerable_error = old.stiffly_accurate ? tolerable_error : 0;
    return old.s;
  }
  if (!control_.repeated && past.suspect_steps > 0) --past.suspect_steps;
  std::vector<double>& l = work_.lagrange;
  l.resize(static_cast<std::size_t>(old.s) + 1);
  const int least = old.stiffly_accurate && !check_.has_algebraic() ? 2 : old.s;
  for (int q = old.s; q >= least; --q) {
    old.closest(theta, q, l.data());
    const auto add_size = [](double sum, double weight) { return sum + std::fabs(weight); };
    if (iteration_.tolerance * std::accumulate(l.begin(), l.end(), 0.0, add_size) > tolerable_error) continue;
    past.tolerable_error = q == old.s && old.stiffly_accurate ? tolerable_error : 0;
    return q;
  }
  return 0;
}

void IrkStepper::start_iteration(double dt) {
  CompiledNewtonStep* code = matrices().code.get();
  if (code) code->begin(*problem_, here_.t, dt, y_.data(), scales_.scale.data());
  const int degree = degree_continued(dt);
  if (code && last_.level == order_.level && degree == f().s) {
    code->predict(dt / last_.dt, last_.y.data(), last_.Z.data());
    return;
  }
  predict(dt, degree);
  if (code) code->set(Z_.data());
}

/// Starting values of Z: the collocation polynomial of the last step, or a
/// lower-degree approximation, continued.
void IrkStepper::predict(double dt, int degree) {
  const auto size = static_cast<std::size_t>(N_);
  if (degree == 0) {
    std::fill(Z_.begin(), Z_.end(), 0.0);
    for (int i = 0; i < f().s; ++i)  // equations nonlinear in x′ need a start for x′
      for (int k = 0; k < n(); ++k) Z_[i * size + k] = f().c[i] * dt * here_.xdot[k];
    return;
  }
  // Since the Lagrange polynomials sum to 1, p(θ) - y₀ = Σ lⱼ(θ) Zⱼ - (y₀ - its value at the old start).
  const IrkFormula& old = *formulas_[last_.level];
  work_.lagrange.resize(static_cast<std::size_t>(old.s) + 1);
  for (int i = 0; i < f().s; ++i) {
    old.closest(1 + f().c[i] * dt / last_.dt, degree, work_.lagrange.data());
    double* Zi = Z_.data() + static_cast<std::size_t>(i) * size;
    for (std::size_t k = 0; k < size; ++k) Zi[k] = last_.y[k] - y_[k];
    combine(N_, Zi, std::span<const double>(work_.lagrange).subspan(1, static_cast<std::size_t>(old.s)),
            last_.Z.data(), N_, Zi);
  }
}

/// R_i = F(tᵢ, y₀ + Zᵢ, (W Z)ᵢ/h); false if not finite.
bool IrkStepper::residuals(double dt) {
  const int s = f().s, states = n();
  const auto size = static_cast<std::size_t>(N_);
  check_.begin();
  for (int i = 0; i < s; ++i) {
    problem_->set_time(here_.t + f().c[i] * dt);
    double* at = problem_->unknowns();
    const double* Zi = Z_.data() + static_cast<std::size_t>(i) * size;
    for (int k = 0; k < states; ++k) at[k] = y_[k] + Zi[k];
    for (int j = 0; j < s; ++j) work_.weights[j] = f().W(i, j) / dt;
    combine(states, nullptr, work_.weights, Z_.data(), N_, at + states);
    for (int k = states; k < N_; ++k) at[states + k] = y_[k] + Zi[k];
    double* R = work_.R.data() + static_cast<std::size_t>(i) * size;
    problem_->residual(R);
    ++stats_.evaluations;
    double sum = 0;
    for (std::size_t k = 0; k < size; ++k) sum += R[k] * 0;
    check_.add(at + states, 1, R, 1, jacobian_.entries);
    if (i == s - 1) std::copy_n(R, N_, work_.residual.begin());
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
      for (int j = 0; j < s; ++j) work_.weights[j] = by(i, j);
      combine(N_, nullptr, work_.weights, from.data(), N_, to.data() + static_cast<std::size_t>(i) * size);
    }
  };
  mix(f().T_inverse, work_.R, work_.transformed);
  double* w = work_.transformed.data();
  if (f().has_real) {
    for (std::size_t k = 0; k < size; ++k) w[k] = -w[k];
    matrices().real.solve(w);
    w += size;
  }
  for (LinearSolver<std::complex<double>>& solver : matrices().complex) {
    for (std::size_t k = 0; k < size; ++k) shifted_.right[k] = {-w[k], w[size + k]};
    solver.solve(shifted_.right.data());
    for (std::size_t k = 0; k < size; ++k) {
      w[k] = shifted_.right[k].real();
      w[size + k] = -shifted_.right[k].imag();
    }
    w += 2 * size;
  }
  mix(f().T, work_.transformed, work_.R);
}

/// F of the last stage in the last iteration, and the distance between its entries.
std::pair<const double*, std::ptrdiff_t> IrkStepper::last_residual() {
  if (CompiledNewtonStep* code = matrices().code.get())
    return {code->stage_of_last_iteration(f().s - 1).residual, CompiledNewtonStep::lanes};
  return {work_.residual.data(), 1};
}

/// Do the slopes and residuals of the last iteration belong to a nearly solved step?
bool IrkStepper::plausible(double dt) {
  if (check_.empty()) return true;
  if (CompiledNewtonStep* code = matrices().code.get()) {
    check_.begin();
    for (int i = 0; i < f().s; ++i) {
      const CompiledNewtonStep::Stage stage = code->stage_of_last_iteration(i);
      check_.add(stage.slope, 1 / dt, stage.residual, CompiledNewtonStep::lanes, jacobian_.entries);
    }
  }
  return check_.plausible(dt, scales_.scale, jacobian_.entries);
}

/// Z ← Z + ΔZ. Returns ‖ΔZ‖, NaN if an equation is not finite.
double IrkStepper::iterate(double dt) {
  const auto size = static_cast<std::size_t>(N_);
  if (!residuals(dt)) return NAN;
  solve_stages();
  ++stats_.newton_iterations;
  double sum = 0, largest = 0;
  for (std::size_t at = 0; at < Z_.size(); at += size)
    apply(N_, Z_.data() + at, work_.R.data() + at, scales_.inverse.data(), sum, largest);
  return ErrorSum::norm(sum, largest, f().s * N_);
}

double IrkStepper::iterate(CompiledNewtonStep& code) {
  double sum = 0, largest = 0;
  stats_.evaluations += f().s;
  ++stats_.newton_iterations;
  code.iterate(sum, largest);
  const double length = ErrorSum::norm(sum, largest, f().s * N_);
  if (!std::isfinite(length)) trouble_ = "the equations are not finite at a stage of the step";
  return length;
}

IrkStepper::Newton IrkStepper::newton(double dt) {
  constexpr double diverging = 0.99;  // this and the factors of a slow step: RADAU5
  const int most = most_iterations();
  double before = 0, quotient_before = 0;
  iteration_.contraction = std::pow(static_cast<float>(std::max(iteration_.contraction, eps)), 0.8f);
  iteration_.theta = keep_jacobian_below;
  CompiledNewtonStep* code = matrices().code.get();
  for (iteration_.count = 1;; ++iteration_.count) {
    const double length = code ? iterate(*code) : iterate(dt);
    if (!std::isfinite(length)) return Newton::not_finite;
    iteration_.length = length;
    if (iteration_.count == 1) iteration_.prediction.first = length;
    if (iteration_.count > 1) {
      const double quotient = length / before;
      iteration_.theta = iteration_.count == 2 ? quotient : std::sqrt(quotient * quotient_before);
      quotient_before = quotient;
      // Far from the solution the first two corrections are no linear sequence: products of their errors come
      // first, and where a small unknown is predicted badly they move the others by as much once more.
      const bool alone = iteration_.count == 2 && jacobian_.fresh && quotient < largest_return &&
                         (rows_.returning || quotient >= diverging);
      if (!(iteration_.theta < diverging) && !alone) return Newton::diverged;
      const double rate = std::min(iteration_.theta, diverging);
      iteration_.contraction = rate / (1 - rate);
      const int left = most - 1 - iteration_.count;
      double predicted = iteration_.contraction * length / iteration_.tolerance;
      for (int k = 0; k < left && predicted >= 1; ++k) predicted *= iteration_.theta;
      if (predicted >= 1 && iteration_.count < most && !alone) {
        iteration_.slow_factor = 0.8 * std::pow(std::clamp(predicted, 1e-4, 20.0), -1.0 / (4 + left));
        return Newton::slow;
      }
    }
    if (iteration_.count == 1 && check_.has_algebraic()) {
      const auto [F, stride] = last_residual();
      check_.set_first(F, stride);
    }
    before = std::max(length, eps);
    // A first iteration does not measure its contraction; far from the solution that of the last step
    // is not reliable.
    const bool measured = iteration_.count > 1 || length <= 1;
    if (measured && iteration_.contraction * length <= iteration_.tolerance && plausible(dt))
      return Newton::converged;
    if (iteration_.count >= most) return Newton::diverged;
  }
}

/// Are the last corrections of a diverging iteration, or a too large error estimate, explained by rounding?
RoundingFloor::Answer IrkStepper::at_rounding(double dt, double length) {
  // amplification by transformations and sums over the stages; measured: 4 … 45
  constexpr double stages = 100;
  if (matrices().code) {  // the compiled step keeps its own factors
    shift(f().gamma / dt);
    if (!matrices().real.factorise(shifted_.real.data())) return RoundingFloor::Answer::no;
  }
  const auto solve = [&](double* right) { matrices().real.solve(right); };
  const auto answer =
      rounding_.judge({rows_.positions, jacobian_.entries, rows_.in_mass,
                       time_terms(here_.t + dt, y_.data(), here_.xdot.data()), solve},
                      y_.data(), here_.xdot.data(), scales_.scale, dt, length, stages, tolerances_);
  if (rounding_.trouble > 0) trouble_ = rounding_text(rounding_, unknown_name(*rounding_.worst));
  if (answer != RoundingFloor::Answer::accepted) return answer;
  iteration_.tolerance = std::max(iteration_.tolerance, std::min(0.1, stages / 10 * rounding_.floor));
  iteration_.theta = 10 * keep_jacobian_below;  // not measured: new Jacobian, same order
  return answer;
}

}  // namespace pendula::integrate
