#include "integrate/problem/rhs_solver.hpp"

#include "base/error.hpp"
#include "base/text.hpp"

#include <algorithm>
#include <cmath>
#include "dae/newton/lifted_newton.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/solve/error_sizes.hpp"

namespace pendula::integrate {
/// Branch-free, unlike std::max.
static double greater(double a, double b) { return a > b ? a : b; }

RhsSolver::RhsSolver(ProblemPtr problem, Stats& stats)
    : problem_(std::move(problem)), stats_(stats), ode_(problem_->is_ode()) {
  if (ode_) return;
  static PerEquations<std::shared_ptr<const RhsLayout>> known;
  layout_ = known.of(*problem_, [&] { return std::make_shared<const RhsLayout>(rhs_layout(*problem_)); });
  usual_.assign(layout_->unknown_is_nonlinear.size(), 0.0);
  jacobian_ = layout_->values;
  const auto unknowns = static_cast<std::size_t>(problem_->n() + problem_->m());
  entries_.resize(layout_->positions.size());
  r_.resize(unknowns);
  residual_.resize(unknowns);
  changed_.resize(unknowns);
  before_.resize(unknowns);
  rounding_.resize(unknowns);
  values_.resize(unknowns + static_cast<std::size_t>(problem_->n()));
  solver_.analyse(static_cast<int>(unknowns), layout_->positions);
}

bool RhsSolver::assemble() {
  jacobian_(problem_->values().data(), entries_.data());
  ++stats_.jacobians;
  ++stats_.factorisations;
  ready_ = solver_.factorise(entries_.data());
  if (ready_) return true;
  const bool finite =
      std::all_of(entries_.begin(), entries_.end(), [](double e) { return std::isfinite(e); });
  trouble_ = finite ? Trouble::singular : Trouble::not_finite;
  return false;
}

bool RhsSolver::operator()(double t, const double* x, double* xdot, double* z) {
  return solve(t, x, xdot, z, true);
}

bool RhsSolver::stage(double t, const double* x, double* xdot, double* z, double accuracy) {
  accuracy_ = std::max(accuracy, rounding);
  const bool solved = solve(t, x, xdot, z, true);
  accuracy_ = rounding;
  return solved;
}

bool RhsSolver::solve(double t, const double* x, double* xdot, double* z, bool near) {
  const int n = problem_->n(), m = problem_->m();
  problem_->set_time(t);
  double* at = problem_->unknowns();
  if (at != x) std::copy_n(x, n, at);
  trouble_ = Trouble::none;
  if (ode_) {
    problem_->rhs(xdot);
    ++stats_.evaluations;
    if (all_finite(n, xdot)) return true;
    trouble_ = Trouble::not_finite;
    for (failed_row_ = 0; std::isfinite(xdot[failed_row_]);) ++failed_row_;
    return false;
  }
  if (version_ != problem_->version()) {
    version_ = problem_->version();
    ready_ = false;
  }
  std::copy_n(xdot, n, at + n);
  std::copy_n(z, m, at + 2 * n);
  if (near || is_linear()) return newton(xdot, z, near);
  begin_.assign(at + n, at + 2 * n + m);
  if (newton(xdot, z, near)) return true;
  const Trouble plain = trouble_;
  for (const auto nearer : {&RhsSolver::approach, &RhsSolver::approach_by_exponents}) {
    std::copy(begin_.begin(), begin_.end(), at + n);
    if ((this->*nearer)() && newton(xdot, z, near)) return true;
  }
  trouble_ = plain;
  std::copy_n(begin_.data(), n, xdot);
  std::copy_n(begin_.data() + n, m, z);
  return false;
}

/// Damped Newton iteration, for exponentials whose linearisation holds in a small neighbourhood only. A step
/// is halved until the next correction with the same matrix, δ̄, satisfies ‖δ̄‖ ≤ (1 - λ/4) ‖δ‖ (natural
/// monotonicity; Deuflhard, Newton Methods for Nonlinear Problems, 2004, §3.2-3.3). Ends when a full step
/// halves the correction. Norms are relative to the values at the beginning.
bool RhsSolver::approach() {
  constexpr int most = 60;                         // steps, each with halvings
  constexpr double least = 1e-6, longest = 1e100;  // damping: 2⁻²⁰; corrections whose squares are finite
  double* at = problem_->unknowns() + problem_->n();
  const std::size_t size = r_.size();
  double largest = 0;
  for (double v : begin_) largest = std::max(largest, std::fabs(v));
  const auto length = [&](const std::vector<double>& step) {
    double sum = 0;
    for (std::size_t i = 0; i < size; ++i)
      sum = std::max(sum, std::fabs(step[i]) / (std::fabs(begin_[i]) + 1e-3 * largest + 1e-300));
    return sum;
  };
  const auto correction = [&](std::vector<double>& step) {
    problem_->residual(step.data());
    ++stats_.evaluations;
    if (!std::all_of(step.begin(), step.end(), [](double v) { return std::fabs(v) < longest; })) return false;
    solver_.solve(step.data());
    return true;
  };
  double damping = 1;
  for (int k = 0; k < most; ++k) {
    if (!assemble() || !correction(r_)) return false;
    const double now = length(r_);
    const std::vector<double> from(at, at + size);
    for (damping = std::min(1.0, 4 * damping);; damping /= 2) {
      if (damping < least) return false;
      for (std::size_t i = 0; i < size; ++i) at[i] = from[i] - damping * r_[i];
      if (correction(changed_) && length(changed_) <= (1 - damping / 4) * now) break;
    }
    ++stats_.newton_iterations;
    if (damping == 1 && length(changed_) <= 0.5 * now) return true;
  }
  return false;
}

/// The iteration with the exponents of the equations as additional unknowns, as for diodes after a jump
/// of their source.
bool RhsSolver::approach_by_exponents() {
  static PerEquations<std::shared_ptr<const dae::LiftedNewton>> known;
  const auto first = 1 + problem_->n(), size = static_cast<int>(r_.size());
  const auto others = [&](const auto& of_arguments) {
    std::decay_t<decltype(of_arguments)> rest(of_arguments.begin(), of_arguments.begin() + first);
    rest.insert(rest.end(), of_arguments.begin() + first + size, of_arguments.end());
    return rest;
  };
  const auto& lifted = known.of(*problem_, [&] {
    const std::span<const Expr> arguments = problem_->arguments();
    return std::make_shared<const dae::LiftedNewton>(problem_->model().F, arguments.subspan(first, size),
                                                     others(problem_->arguments()));
  });
  if (!lifted->applies()) return false;
  const auto found =
      (*lifted)(Eigen::Map<const Vec>(begin_.data(), size), others(problem_->values()), Vec::Ones(size));
  if (found) std::copy_n(found->data(), size, problem_->unknowns() + problem_->n());
  return found.has_value();
}

/// One correction with the current factorisation. Returns its norm relative to the unknowns, NaN if F is not
/// finite; sets relative_change_ and nonlinear_change_.
double RhsSolver::correct(double* xdot, double* z) {
  const int n = problem_->n(), m = problem_->m(), N = n + m;
  problem_->residual(r_.data());
  ++stats_.evaluations;
  if (!all_finite(N, r_.data())) {
    trouble_ = Trouble::not_finite;
    for (failed_row_ = 0; std::isfinite(r_[failed_row_]);) ++failed_row_;
    return NAN;
  }
  solver_.solve(r_.data());
  ++stats_.newton_iterations;
  double* at = problem_->unknowns() + n;
  const double *const change = r_.data(), *const usual = usual_.data(),
                      *const unknown_is_nonlinear = layout_->unknown_is_nonlinear.data();
  double size = 0;
  for (int i = 0; i < N; ++i) {
    at[i] -= change[i];
    size = greater(size, std::fabs(at[i]));
  }
  constexpr double least = std::numeric_limits<double>::min();
  const double beside = 1e-3 * size + least;
  double largest = 0, moved = 0, nonlinear_change = 0;
  for (int i = 0; i < N; ++i) {
    const double length = std::fabs(change[i]), value = std::fabs(at[i]);
    const double own = length / (value + 0.1 * usual[i] + least);
    largest = greater(largest, length / (value + beside));
    moved = greater(moved, own);
    nonlinear_change = greater(nonlinear_change, own * unknown_is_nonlinear[i]);
  }
  relative_change_ = moved;
  nonlinear_change_ = nonlinear_change;
  std::copy_n(at, n, xdot);
  std::copy_n(at + n, m, z);
  return largest;
}

/// Is F a rounding error: no larger than its change under changes in the last bits of x, x′ and z? Where the
/// terms of a small x′ are large, corrections never become small relative to x′.
bool RhsSolver::solved_to_rounding() {
  constexpr double last_bits = 4 * std::numeric_limits<double>::epsilon();
  double* at = problem_->unknowns();
  problem_->residual(residual_.data());
  std::copy_n(at, values_.size(), values_.begin());
  std::fill(rounding_.begin(), rounding_.end(), 0.0);
  ++stats_.evaluations;
  for (std::size_t run = 1; run < 2 * values_.size();
       run *= 2) {  // any two values have different signs in one of the patterns
    for (std::size_t j = 0; j < values_.size(); ++j)
      at[j] = values_[j] * (1 + (j / run % 2 == 0 ? last_bits : -last_bits));
    problem_->residual(changed_.data());
    ++stats_.evaluations;
    for (std::size_t i = 0; i < residual_.size(); ++i) rounding_[i] += std::fabs(changed_[i] - residual_[i]);
  }
  std::copy(values_.begin(), values_.end(), at);
  for (std::size_t i = 0; i < residual_.size(); ++i)
    if (!(std::fabs(residual_[i]) <= rounding_[i])) return false;
  return true;
}

/// Predicts the error after a correction with a matrix of the preceding point (fresh) or an older one.
/// Newton: δₖ₊₁ ≈ C δₖ²; with a matrix from a distance d to the solution: δₖ₊₁ ≈ 2 C d δₖ; measured: θ δₖ
/// (Hairer & Wanner II, §IV.8). Norms are relative to each unknown, so that a small current counts as much as
/// a fast x′.
void RhsSolver::expect(Progress& progress, bool fresh, bool first) {
  constexpr double least = 0.1, remembered = 0.5, careful = 10;
  const double before = progress.last;
  // the first correction solves exactly for unknowns in which the equations are linear
  const double now = progress.last = first ? nonlinear_change_ : relative_change_;
  if (first || !(before > 0)) {
    progress.distance = now;
    progress.rate = 2 * curvature_ * now;
    progress.expected = careful * curvature_ * now * now;
    return;
  }
  const double theta = now / before;
  if (progress.distance <= before) curvature_ = std::max({least, remembered * curvature_, theta / before});
  progress.distance = fresh ? now : progress.distance + now;
  progress.rate = fresh ? 2 * curvature_ * now : std::max(theta, 2 * curvature_ * progress.distance);
  progress.expected =
      fresh ? careful * curvature_ * now * now : progress.rate * now / (1 - std::min(progress.rate, 0.5));
}

/// Does a new matrix save more iterations than it costs?
bool RhsSolver::renewal_pays(const Progress& progress) const {
  // Above a rate of 0.1 a new matrix hardly ever costs more than the iterations that it saves. Measured rates
  // below 10⁻³ are rounding errors. A factorisation costs 0.7 iterations up to 15 unknowns, more in
  // proportion to their number beyond (sparse LU, as in implicit_cost()).
  constexpr double quickest = 1e-3, slow = 0.1;
  constexpr double factorisation = 0.7, usual = 15;
  if (progress.rate > slow) return true;
  const double distance = accuracy_ / std::max(progress.expected, accuracy_);
  const double kept = std::ceil(std::log(distance) / std::log(std::max(progress.rate, quickest)));
  double renewed = 1;
  for (double error = curvature_ * progress.expected * progress.expected; error > accuracy_ && renewed < 6;
       ++renewed)
    error *= curvature_ * error;
  const double cost = 1 + factorisation * std::max(1.0, static_cast<double>(r_.size()) / usual);
  return cost * renewed < kept;
}

/// maxₖ |Jᵢₖ yₖ| of every equation i.
std::vector<double>& RhsSolver::largest_terms() {
  const double* at = problem_->unknowns() + problem_->n();
  std::fill(rounding_.begin(), rounding_.end(), 0.0);
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    double& term = rounding_[layout_->positions[k].row];
    term = greater(term, std::fabs(entries_[k] * at[layout_->positions[k].column]));
  }
  return rounding_;
}

/// Is the change of every nonlinear term by the last correction negligible? (Norms of corrections do not show
/// it: relative to an x′ of 10⁶⁰, in the first iterations for an exponential, corrections of the other
/// unknowns look like rounding errors.)
bool RhsSolver::is_nearly_linear() {
  constexpr double visible = 1e-6;  // `small` in newton(): the change of the next iteration is its square
  const std::vector<double>& terms = largest_terms();
  for (std::size_t k = 0; k < entries_.size(); ++k)
    if (const auto [row, column] = layout_->positions[k];
        layout_->entry_is_nonlinear[k] && std::fabs(entries_[k] * r_[column]) > visible * terms[row])
      return false;
  return true;
}

/// The ratio of the last two corrections, in units derived from the equations: the unit of unknown j is the
/// size at which it dominates an equation, minᵢ maxₖ |Jᵢₖ yₖ|/|Jᵢⱼ|, or its value if that is larger. Its
/// value alone is no unit: the angle of a bar that stays level is 0, and every correction of it is large
/// relative to that.
double RhsSolver::contraction() {
  const std::size_t size = r_.size();
  const double* at = problem_->unknowns() + problem_->n();
  std::vector<double>&terms = largest_terms(), &units = changed_;
  std::fill(units.begin(), units.end(), std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < entries_.size(); ++k)
    if (entries_[k] != 0)
      units[layout_->positions[k].column] = std::min(
          units[layout_->positions[k].column], terms[layout_->positions[k].row] / std::fabs(entries_[k]));
  double now = 0, before = 0;
  for (std::size_t j = 0; j < size; ++j) {
    if (layout_->ambiguous[j] == 0) continue;
    const double unit = greater(units[j], std::fabs(at[j])) + std::numeric_limits<double>::min();
    now = greater(now, std::fabs(r_[j]) / unit);
    before = greater(before, std::fabs(before_[j]) / unit);
  }
  return now > 0 ? now / before : 0;
}

bool RhsSolver::newton(double* xdot, double* z, bool near) {
  constexpr double stagnation = 1e-11, fast = 0.25, small = 1e-6, certain = 0.1;
  if (is_linear()) {
    if ((!layout_->constant || !ready_) && !assemble()) return false;
    return !std::isnan(correct(xdot, z));
  }
  double previous = std::numeric_limits<double>::infinity();
  double slowest = 0.5;
  Progress progress;
  const double* at = problem_->unknowns() + problem_->n();
  for (std::size_t i = 0; i < usual_.size(); ++i) usual_[i] = std::max(usual_[i] / 2, std::fabs(at[i]));
  for (int k = 0; k < 40; ++k) {
    // A new matrix is formed at the first point, after a large correction (the old one may lead to another
    // root), and whenever the old one contracts slowly.
    constexpr double far = 0.1;
    const bool fresh = !ready_ || previous > far || k > 2 || renewal_pays(progress);
    if (fresh && !assemble()) return false;
    std::swap(before_, r_);
    const double now = correct(xdot, z);
    if (std::isnan(now)) return ready_ = false;
    expect(progress, fresh, k == 0);
    const bool stagnates = now <= stagnation && now >= previous / 2;
    const bool still = now <= rounding || (stagnates && fresh);  // old matrices contract slowly as well
    // With matrices of this point, a correction that does not shrink is rounding, as where an unknown is the
    // difference of two lengths in kilometres. At a double root it would be halved.
    constexpr double shrinks = 0.75;  // between the 1/2 of a double root and the 1 of rounding
    const bool stuck = k >= 4 && now <= small && now >= shrinks * previous;
    if ((still || stuck) && (nonlinear_change_ <= small || is_nearly_linear() || solved_to_rounding()))
      return true;
    if (progress.expected <= accuracy_ && progress.rate <= certain) return true;
    constexpr double hopeless = 1e3;  // relative to the unknowns: the iteration diverges
    if (k > 20 && now > hopeless) break;
    if (near && k > 0 && previous > small && now > slowest * previous && contraction() > slowest) {
      ready_ = false;
      if (fresh) {
        if (k > 2 && solved_to_rounding()) return true;
        trouble_ = Trouble::far;
        return false;
      }
      slowest = fast;  // an old matrix contracts slowly on the right branch, too; new ones must do better
    }
    if (k >= 6 && now > slowest * previous && solved_to_rounding()) return true;  // all matrices were new
    previous = now;
  }
  trouble_ = Trouble::diverged;
  return ready_ = false;
}

}  // namespace pendula::integrate
