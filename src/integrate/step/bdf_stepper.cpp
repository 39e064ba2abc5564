#include "integrate/step/bdf_stepper.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/epsilon.hpp"
#include "base/interrupt.hpp"
#include "integrate/solve/predictive_controller.hpp"

namespace pendula::integrate {
namespace {

/// κ of the NDF: larger steps than BDF at a small loss of stability; 0 at order 5 (Shampine & Reichelt, SIAM
/// J. Sci. Comput. 18(1), 1997).
constexpr std::array<double, 6> kappa = {0, -0.1850, -1.0 / 9, -0.0823, -0.0415, 0};
/// γₖ = Σ_{j ≤ k} 1/j
constexpr std::array<double, 6> harmonic = {0, 1, 1.5, 11.0 / 6, 25.0 / 12, 137.0 / 60};

double alpha(int k) { return (1 - kappa[k]) * harmonic[k]; }
/// In a multistep method the errors of many small steps have one sign and add up; those of a one-step method
/// are fewer and of mixed signs. The tolerance per step is therefore a fifth of the requested one, so that
/// all methods reach about the same global error (tests/integrate/run/detest_test.lua).
constexpr double strictness = 5;

double error_constant(int k) { return strictness * (kappa[k] * harmonic[k] + 1.0 / (k + 1)); }

/// Transforms differences for steps of size h to those for `factor` h: the polynomial at -i·factor, expressed
/// by its differences at 0, -1, … (ibid., §2.2).
Mat difference_matrix(int k, double factor) {
  Mat R = Mat::Ones(k + 1, k + 1);
  R.col(0).tail(k).setZero();
  for (int i = 1; i <= k; ++i)
    for (int j = 1; j <= k; ++j) R(i, j) = (i - 1 - factor * j) / i;
  for (int i = 1; i <= k; ++i) R.row(i) = R.row(i).cwiseProduct(R.row(i - 1));
  return R;
}

}  // namespace

BdfStepper::BdfStepper(ProblemPtr problem, int highest_order, std::vector<int> index, Tolerances tolerances,
                       StepLimits limits, Stats& stats)
    : Stepper(std::move(problem), std::move(tolerances), limits, stats),
      N_(n() + m()),
      highest_(std::clamp(highest_order, 1, most)),
      index_(std::move(index)),
      rhs_(problem_, stats),
      check_(*problem_) {
  if (index_.empty()) index_.assign(static_cast<std::size_t>(N_), 1);
  for (const Problem::Entry& e : problem_->pattern()) {
    rows_.in_mass.push_back(e.column >= n() && e.column < 2 * n());
    rows_.positions.push_back({e.row, e.column < n() ? e.column : e.column - n()});
  }
  jacobian_.matrix.resize(rows_.positions.size());
  solver_.analyse(N_, rows_.positions);
  rounding_ = RoundingFloor(index_, n());
  const bool high_index = std::any_of(index_.begin(), index_.end(), [](int i) { return i > 1; });
  rows_.returning = check_.slopes_return();
  rows_.column_scale.assign(high_index ? static_cast<std::size_t>(N_) : 0, 1.0);
  const auto size = static_cast<std::size_t>(N_);
  history_.differences.assign(size * (most + 3), 0.0);
  Attempt& a = attempt_;
  for (auto* v : {&a.predicted, &a.psi, &a.y, &a.d, &a.r, &a.scale}) v->assign(size, 0.0);
  for (Point* p : {&next_, &before_}) {
    p->x.resize(n());
    p->xdot.resize(n());
    p->z.resize(m());
  }
  constexpr double least = 1e-13;  // about the smallest rtol that makes sense (plan.cpp); it may be 0
  iteration_.tolerance = newton_tolerance(std::max(tolerances_.rtol.minCoeff(), least));
}

void BdfStepper::start(const Point& point, double end) {
  here_ = point;
  determined_ = std::all_of(index_.begin(), index_.end(), [](int i) { return i == 1; });
  determined_ = determined_ && rhs_.settle(here_);  // otherwise x′ and z as given by the start
  const double longest = std::min(end - here_.t, limits_.dt_max);
  dt_ = limits_.dt_first;
  if (dt_ <= 0) {
    ErrorSum slope;
    for (int i = 0; i < n(); ++i) slope.add(here_.xdot[i] / weight(i, std::fabs(here_.x[i])));
    // At most a thousandth of the rest of the interval. If x is at rest, its slope contains no
    // information, and a step to the next point of rest, from one border of max(0, sin t) to the next, has
    // no visible error.
    const double d1 = n() > 0 ? slope.norm(n()) : 0, most_of_all = 1e-3 * longest;
    dt_ = visible(d1 * most_of_all > 0.5 ? 0.5 / d1 : most_of_all, longest);
  }
  history_.order = 1;
  history_.equal_steps = 0;
  rounding_.forget();
  jacobian_.entries.clear();
  rejected_ = jacobian_.fresh = false;
  jacobian_.factorised_for = 0;
  std::fill(history_.differences.begin(), history_.differences.end(), 0.0);
  std::copy_n(here_.x.data(), n(), D(0));
  std::copy_n(here_.z.data(), m(), D(0) + n());
  for (int k = 0; k < n(); ++k) D(1)[k] = dt_ * here_.xdot[k];
  z_slopes_known_ = m() == 0 || !determined_;
}

/// While no slope of z is known, the first step must not change z by more than its tolerance; if z changes
/// fast, it becomes too small relative to t. This function replaces it by a longer step whose slopes of z
/// come from a difference; false if that is impossible.
bool BdfStepper::predict_algebraic(double end) {
  constexpr double longer = 1e6;  // than the smallest visible one
  if (z_slopes_known_) return false;
  z_slopes_known_ = true;
  rescale(std::min(longer * dt_, end - here_.t) / dt_);
  const Vec x = here_.x + dt_ * here_.xdot;
  Vec xdot = here_.xdot, z = here_.z;
  if (!rhs_(here_.t + dt_, x.data(), xdot.data(), z.data()) || !z.allFinite()) return false;
  Eigen::Map<Vec>(D(1) + n(), m()) = z - here_.z;
  return true;
}

/// Transforms the differences to a step size `factor` times as large.
void BdfStepper::rescale(double factor) {
  const Mat RU = difference_matrix(history_.order, factor) * difference_matrix(history_.order, 1);
  Eigen::Map<Mat> all(history_.differences.data(), N_, history_.order + 1);
  all = (all * RU).eval();
  dt_ *= factor;
  history_.equal_steps = 0;
}

void BdfStepper::predict() {
  attempt_.c = dt_ / alpha(history_.order);
  for (int k = 0; k < N_; ++k) {
    double sum = D(0)[k], psi = 0;
    for (int j = 1; j <= history_.order; ++j) {
      sum += D(j)[k];
      psi += D(j)[k] * harmonic[j];
    }
    const auto i = static_cast<std::size_t>(k);
    attempt_.predicted[i] = sum;
    attempt_.psi[i] = psi / alpha(history_.order);
    attempt_.scale[i] = scale(k, std::fabs(sum));
  }
}

void BdfStepper::update_differences() {
  const double* d = attempt_.d.data();
  for (int k = 0; k < N_; ++k) {
    D(history_.order + 2)[k] = d[k] - D(history_.order + 1)[k];
    D(history_.order + 1)[k] = d[k];
    for (int j = history_.order; j >= 0; --j) D(j)[k] += D(j + 1)[k];
  }
}

/// Reduced by the number of iterations used: fewer iterations allow longer steps (Hairer & Wanner II, §IV.8).
double BdfStepper::safety_factor() const {
  return PredictiveController::safety * (2 * most_corrections + 1) /
         (2 * most_corrections + iteration_.count);
}

void BdfStepper::choose_order(double error) {
  if (history_.equal_steps < history_.order + 1) return;
  constexpr double longest = 10;  // of successive steps: ode15s and SciPy's BDF have the same limit
  // of the size: a step within them is not worth a factorisation (RADAU5 keeps its size from 1 to 1.2)
  constexpr double less = 0.9, more = 1.2;
  const double safety = safety_factor();
  const auto factor = [](double e, int k) { return e > 0 ? std::pow(e, -1.0 / (k + 1)) : longest; };
  double best = factor(error, history_.order);
  int wanted = history_.order;
  if (history_.order > 1)
    if (const double f =
            factor(scaled_norm(D(history_.order), error_constant(history_.order - 1)), history_.order - 1);
        f > best) {
      best = f;
      wanted = history_.order - 1;
    }
  if (history_.order < highest_)
    if (const double f = factor(scaled_norm(D(history_.order + 2), error_constant(history_.order + 1)),
                                history_.order + 1);
        f > best) {
      best = f;
      wanted = history_.order + 1;
    }
  const double change = std::min(longest, safety * best);
  if (wanted == history_.order && change < more && change >= less) return;
  history_.order = wanted;
  rescale(std::min(change, limits_.dt_max / dt_));
}

void BdfStepper::set_end(double t) {
  next_.t = t;
  for (int k = 0; k < n(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    next_.x[k] = attempt_.y[i];
    next_.xdot[k] = (attempt_.psi[i] + attempt_.d[i]) / attempt_.c;
  }
  for (int k = n(); k < N_; ++k) next_.z[k - n()] = attempt_.y[k];
}

void BdfStepper::step(double end) {
  rejected_ = false;
  for (;;) {
    poll_interrupt();
    if (failures_ >= suspicious_failures) {
      failures_ = 0;
      // once for each point: where z is known to rounding only, it would be found elsewhere for ever
      if (restarted_at_ != here_.t && (determined_ ? settle_again(rhs_) : history_.order > 1)) {
        restarted_at_ = here_.t;
        start(here_, end);
      }
    }
    const double dt = fitted(dt_, end);
    if (dt != dt_) rescale(dt / dt_);
    dt_ = dt;
    if ((dt != end - here_.t || rejected_) && !is_visible(dt)) {
      if (predict_algebraic(end)) continue;
      throw vanished(Eigen::Map<const Vec>(attempt_.d.data(), trouble_.empty() ? N_ : 0),
                     trouble_.empty() && rounding_.raised() ? raised_text() : trouble_);
    }
    trouble_.clear();
    const double t = dt == end - here_.t ? end : here_.t + dt;
    predict();
    Newton outcome = solve_step(t);
    if (outcome == Newton::slow) {
      const RoundingFloor::Answer answer = at_rounding(iteration_.length);
      if (answer == RoundingFloor::Answer::raised) continue;
      if (answer == RoundingFloor::Answer::accepted) outcome = Newton::converged;
    }
    if (outcome != Newton::converged) {
      reject(outcome == Newton::slow ? 0.5 : 0.25);
      continue;
    }
    for (int k = 0; k < N_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      attempt_.scale[i] = scale(k, std::fabs(attempt_.y[i]));
    }
    const double error = scaled_norm(attempt_.d.data(), error_constant(history_.order));
    if (error <= 1) return accept(t, error);
    if (rounding_.may_raise(rejected_) && at_rounding(error) == RoundingFloor::Answer::raised) continue;
    const double factor = safety_factor() * std::pow(error, -1.0 / (history_.order + 1));
    constexpr double shortest = 0.2;  // of a step that failed: as in SciPy's BDF
    reject(std::isfinite(error) ? std::max(shortest, factor) : shortest);
  }
}

/// Prepares a repetition with a step reduced by the factor. With algebraic unknowns the Jacobian is dropped:
/// it belongs to the predicted end, and along z, which may change fast, that may be useless or far too large.
void BdfStepper::reject(double factor) {
  ++stats_.rejected;
  rejected_ = true;
  jacobian_.fresh = false;
  ++failures_;
  if (check_.has_algebraic()) jacobian_.entries.clear();
  rescale(factor);
}

void BdfStepper::accept(double t, double error) {
  set_end(t);
  ++stats_.steps;
  stats_.errors += error;
  ++history_.equal_steps;
  jacobian_.fresh = false;
  failures_ = 0;
  check_.accept();
  z_slopes_known_ = true;
  update_differences();
  last_.order = history_.order;
  last_.t = t;
  last_.dt = dt_;
  last_.differences.assign(D(0), D(history_.order + 1));
  choose_order(error);
  std::swap(before_, here_);
  std::swap(here_, next_);
}

void BdfStepper::record(double* to) const {
  *to++ = last_.order;
  *to++ = last_.t;
  *to++ = last_.dt;
  std::copy(last_.differences.begin(), last_.differences.end(), to);
}

/// Evaluates the polynomial through the last k + 1 points by its backward differences.
Detail BdfStepper::look(const StepView& step, double t, Detail detail, Point& out) {
  if (t >= step.to.t) {
    out = step.to;
    return Detail::full;
  }
  const int k = static_cast<int>(step.record[0]);
  const double end = step.record[1], dt = step.record[2];
  const double* differences = step.record + 3;
  out.t = t;
  out.x.resize(n());
  out.xdot.resize(n());
  out.z.resize(m());
  out.x.setZero();
  out.xdot.setZero();
  out.z.setZero();
  double factor = 1, slope = 0;
  for (int j = 0; j <= k; ++j) {
    if (j > 0) {
      const double u = ((t - end) / dt + j - 1) / j;
      slope = slope * u + factor / (j * dt);
      factor *= u;
    }
    const double* Dj = differences + static_cast<std::ptrdiff_t>(j) * N_;
    for (int i = 0; i < n(); ++i) {
      out.x[i] += factor * Dj[i];
      out.xdot[i] += slope * Dj[i];
    }
    for (int i = n(); i < N_; ++i) out.z[i - n()] += factor * Dj[i];
  }
  if (detail == Detail::full && determined_) rhs_(t, out.x.data(), out.xdot.data(), out.z.data());
  return detail;
}

}  // namespace pendula::integrate
