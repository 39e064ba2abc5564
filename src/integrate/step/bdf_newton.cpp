// Newton's iteration of a multistep step: Jacobian, factorisation, corrections, and checks of
// the remaining residual.
#include <algorithm>
#include <cmath>

#include "integrate/step/bdf_stepper.hpp"

namespace pendula::integrate {

/// The tolerance of unknown k, divided by dt per index.
double BdfStepper::scale(int k, double size) const {
  return std::max(weight(k, size) * tolerances_.relaxation(k, index_[k], dt_),
                  rounding_.least(k, dt_, tolerances_));
}

double BdfStepper::scaled_norm(const double* e, double factor) const {
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) sum.add(factor * e[k] / attempt_.scale[k]);
  return sum.norm(N_);
}

bool BdfStepper::evaluate_jacobian(double t) {
  jacobian_.fresh = true;
  jacobian_.factorised_for = 0;
  double* at = problem_->unknowns();
  const auto take = [&](double time, const double* x) {
    problem_->set_time(time);
    for (int k = 0; k < n(); ++k) {
      at[k] = x[k];
      at[n() + k] = attempt_.psi[k] / attempt_.c;
    }
    for (int k = n(); k < N_; ++k) at[n() + k] = attempt_.predicted[k];
    jacobian_.entries = problem_->jacobian();
    ++stats_.jacobians;
    return std::all_of(jacobian_.entries.begin(), jacobian_.entries.end(),
                       [](double e) { return std::isfinite(e); });
  };
  return take(t, attempt_.predicted.data()) ||
         take_beside([&](const Point& there) { return take(there.t, there.x.data()); });
}

bool BdfStepper::factorise() {
  for (std::size_t k = 0; k < rows_.column_scale.size(); ++k)
    rows_.column_scale[k] = std::pow(attempt_.c, 1 - index_[k]);
  for (std::size_t k = 0; k < jacobian_.entries.size(); ++k) {
    jacobian_.matrix[k] = rows_.in_mass[k] ? jacobian_.entries[k] / attempt_.c : jacobian_.entries[k];
    if (!rows_.column_scale.empty()) jacobian_.matrix[k] *= rows_.column_scale[rows_.positions[k].column];
  }
  ++stats_.factorisations;
  jacobian_.factorised_for = solver_.factorise(jacobian_.matrix.data()) ? attempt_.c : 0;
  return jacobian_.factorised_for != 0;
}

void BdfStepper::solve(double* right) {
  solver_.solve(right);
  for (std::size_t k = 0; k < rows_.column_scale.size(); ++k) right[k] *= rows_.column_scale[k];
}

/// Are the last corrections of a diverging iteration, or a too large error estimate, explained by rounding?
RoundingFloor::Answer BdfStepper::at_rounding(double length) {
  constexpr double sums = 100;  // amplification by differences and sums over the steps
  std::vector<double> slopes(static_cast<std::size_t>(n()));
  for (std::size_t k = 0; k < slopes.size(); ++k) slopes[k] = (attempt_.psi[k] + attempt_.d[k]) / attempt_.c;
  const auto answer = rounding_.judge(
      {rows_.positions, jacobian_.entries, rows_.in_mass,
       time_terms(here_.t + dt_, attempt_.y.data(), slopes.data()), [&](double* right) { solve(right); }},
      attempt_.y.data(), slopes.data(), attempt_.scale, dt_, length, sums, tolerances_);
  if (rounding_.trouble > 0) trouble_ = rounding_text(rounding_, unknown_name(*rounding_.worst));
  if (answer == RoundingFloor::Answer::accepted)
    iteration_.tolerance = std::max(iteration_.tolerance, std::min(0.1, sums / 10 * rounding_.floor));
  return answer;
}

/// Do x′ and the residual of the last iteration belong to a nearly solved step? A measured contraction below
/// ½ is sufficient as well, since the Jacobian is then accurate to a factor of two.
bool BdfStepper::plausible() {
  if (check_.empty()) return true;
  check_.begin();
  check_.add(problem_->unknowns() + n(), 1, attempt_.residual.data(), 1, jacobian_.entries);
  return check_.plausible(dt_, attempt_.scale, jacobian_.entries);
}

/// Evaluates F at y⁰ + d into r.
void BdfStepper::residual_at_end() {
  double* at = problem_->unknowns();
  for (int k = 0; k < N_; ++k) {
    at[k < n() ? k : n() + k] = attempt_.y[k];
    if (k < n()) at[n() + k] = (attempt_.psi[k] + attempt_.d[k]) / attempt_.c;
  }
  problem_->residual(attempt_.r.data());
  ++stats_.evaluations;
}

/// A Jacobian that is far too large, from before the end of a stiff phase or from a point with a huge
/// exponential, makes corrections tiny. Is there a residual that would be visible without it?
bool BdfStepper::is_hidden() {
  const auto visible = [&](const std::vector<double>& F) {
    return determined_ && !jacobian_.fresh &&
           check_.is_visible(attempt_.c, F.data(), attempt_.scale, jacobian_.entries);
  };
  if (!visible(attempt_.residual) && !check_.stagnates(attempt_.residual.data(), 1)) return false;
  residual_at_end();
  if (visible(attempt_.r)) return true;
  check_.set_first(attempt_.residual.data(), 1);
  return check_.stagnates(attempt_.r.data(), 1) && !is_corrected();
}

/// Judges the residual by the Jacobian at y⁰ + d: is it rounding, or its correction within the tolerance of
/// the iteration? In the second case the correction is applied and that Jacobian is kept.
bool BdfStepper::is_corrected() {
  const std::vector<double> F = attempt_.r;
  const std::vector<double>& entries = problem_->jacobian();
  ++stats_.jacobians;
  if (!std::all_of(entries.begin(), entries.end(), [](double e) { return std::isfinite(e); })) return false;
  if (!check_.stagnates(F.data(), attempt_.y.data(), entries)) {
    check_.set_harmless(F.data(), attempt_.y.data(), entries);
    return true;
  }
  jacobian_.entries = entries;
  jacobian_.fresh = true;
  if (!factorise()) return false;
  solve(attempt_.r.data());
  const double norm = scaled_norm(attempt_.r.data(), 1);
  if (!(norm <= iteration_.tolerance)) return false;
  check_.set_harmless(F.data(), attempt_.y.data(), jacobian_.entries);
  for (std::size_t i = 0; i < attempt_.d.size(); ++i) {
    attempt_.d[i] -= attempt_.r[i];
    attempt_.y[i] = attempt_.predicted[i] + attempt_.d[i];
  }
  return true;
}

/// Solves F(t, y⁰ + d, (ψ + d)/c) = 0 for d.
BdfStepper::Newton BdfStepper::newton(double t) {
  problem_->set_time(t);
  double* at = problem_->unknowns();
  std::fill(attempt_.d.begin(), attempt_.d.end(), 0.0);
  double before = 0, quotient_before = 0;
  for (iteration_.count = 1; iteration_.count <= most_corrections; ++iteration_.count) {
    for (int k = 0; k < N_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      attempt_.y[i] = attempt_.predicted[i] + attempt_.d[i];
      at[k < n() ? k : n() + k] = attempt_.y[i];
      if (k < n()) at[n() + k] = (attempt_.psi[i] + attempt_.d[i]) / attempt_.c;
    }
    problem_->residual(attempt_.r.data());
    ++stats_.evaluations;
    ++stats_.newton_iterations;
    double finite = 0;
    for (double r : attempt_.r) finite += r * 0;
    if (finite != 0) {
      trouble_ = "the equations are not finite near here";
      return Newton::not_finite;
    }
    attempt_.residual = attempt_.r;
    if (iteration_.count == 1) check_.set_first(attempt_.r.data(), 1);
    solve(attempt_.r.data());
    const double length = scaled_norm(attempt_.r.data(), 1);
    iteration_.length = length;
    const double quotient = iteration_.count > 1 ? length / before : 0;
    const bool returns = rows_.returning && quotient < largest_return;
    const double rate = returns && iteration_.count > 2 ? std::sqrt(quotient * quotient_before) : quotient;
    // at any rate of convergence, since rounding has none
    constexpr double negligible_share = 1e-3;
    const bool negligible = length <= negligible_share * iteration_.tolerance;
    const bool alone = iteration_.count == 2 && returns;
    if (iteration_.count > 1 && !negligible && !alone &&
        (rate >= 1 ||
         std::pow(rate, most_corrections - iteration_.count) / (1 - rate) * length > iteration_.tolerance))
      break;
    for (std::size_t i = 0; i < attempt_.d.size(); ++i) attempt_.d[i] -= attempt_.r[i];
    const bool small =
        negligible || (iteration_.count > 1 && rate < 1 && rate / (1 - rate) * length < iteration_.tolerance);
    if (small && ((iteration_.count > 1 && rate < 0.5) || plausible())) {
      for (std::size_t i = 0; i < attempt_.d.size(); ++i)
        attempt_.y[i] = attempt_.predicted[i] + attempt_.d[i];
      return is_hidden() ? Newton::slow : Newton::converged;
    }
    before = length;
    quotient_before = quotient;
  }
  return Newton::slow;
}

/// Newton's iteration with the current Jacobian, then with a new one.
BdfStepper::Newton BdfStepper::solve_step(double t) {
  Newton result = Newton::not_finite;
  for (int attempt = 0; attempt < 2 && result != Newton::converged; ++attempt) {
    if (jacobian_.entries.empty() || (attempt > 0 && !jacobian_.fresh)) {
      if (!evaluate_jacobian(t)) {
        trouble_ = "the equations are not finite near here";
        jacobian_.entries.clear();
        break;
      }
    } else if (attempt > 0) {
      break;
    }
    if (jacobian_.factorised_for != attempt_.c && !factorise()) {
      trouble_ = "the iteration matrix is singular";
      continue;
    }
    result = newton(t);
  }
  return result;
}

}  // namespace pendula::integrate
