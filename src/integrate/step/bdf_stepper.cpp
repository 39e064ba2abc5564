#include "integrate/step/bdf_stepper.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/interrupt.hpp"

namespace pendula::integrate {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr int most_iterations = 4;
/// κ of the NDF: larger steps than BDF at a small loss of stability; 0 at order 5.
constexpr std::array<double, 6> kappa = {0, -0.1850, -1.0 / 9, -0.0823, -0.0415, 0};
/// γₖ = Σ_{j ≤ k} 1/j
constexpr std::array<double, 6> harmonic = {0, 1, 1.5, 11.0 / 6, 25.0 / 12, 137.0 / 60};

double alpha(int k) { return (1 - kappa[k]) * harmonic[k]; }
/// The errors of a multistep method have one sign over many small steps and add up, where those of a one-step
/// method are few and mixed: the tolerance per step is a fifth of what was asked for, so that all methods
/// reach about the same global error (tests/integrate/run/detest_test.lua).
constexpr double strictness = 5;

double error_constant(int k) { return strictness * (kappa[k] * harmonic[k] + 1.0 / (k + 1)); }

/// Differences for a step of `factor` h from those for h: the values of the polynomial at -i·factor as
/// differences of it at 0, -1, … (ibid., §2.2).
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
      derivative_(problem_, stats) {
  if (index_.empty()) index_.assign(static_cast<std::size_t>(N_), 1);
  for (const Problem::Entry& e : problem_->pattern()) {
    in_mass_.push_back(e.column >= n() && e.column < 2 * n());
    positions_.push_back({e.row, e.column < n() ? e.column : e.column - n()});
  }
  matrix_.resize(positions_.size());
  solver_.analyse(N_, positions_);
  rounding_ = RoundingFloor(index_, n());
  const bool high_index = std::any_of(index_.begin(), index_.end(), [](int i) { return i > 1; });
  column_scale_.assign(high_index ? static_cast<std::size_t>(N_) : 0, 1.0);
  const auto size = static_cast<std::size_t>(N_);
  differences_.assign(size * (most + 3), 0.0);
  for (auto* v : {&predicted_, &psi_, &y_, &d_, &r_, &scale_}) v->assign(size, 0.0);
  for (Point* p : {&next_, &before_}) p->x.resize(n()), p->xdot.resize(n()), p->z.resize(m());
  const double smallest = std::max(tolerances_.rtol.minCoeff(), 1e-13);
  newton_tolerance_ = std::max(10 * eps / smallest, std::min(0.03, std::sqrt(smallest)));
}

void BdfStepper::start(const Point& point, double end) {
  here_ = point;
  determined_ = std::all_of(index_.begin(), index_.end(), [](int i) { return i == 1; });
  determined_ = determined_ && derivative_.settle(here_);  // else x′ and z as the start gives them
  const double longest = std::min(end - here_.t, limits_.dt_max);
  dt_ = limits_.dt_first;
  if (dt_ <= 0) {
    ErrorSum slope;
    for (int i = 0; i < n(); ++i) slope.add(here_.xdot[i] / weight(i, std::fabs(here_.x[i])));
    const double d1 = n() > 0 ? slope.norm(n()) : 0;
    dt_ = visible(d1 > 0 ? 0.5 / d1 : 1e-3 * longest, longest);
  }
  order_ = 1, equal_steps_ = 0;
  rounding_.forget();
  entries_.clear();
  rejected_ = jacobian_current_ = false;
  factorised_for_ = 0;
  std::fill(differences_.begin(), differences_.end(), 0.0);
  std::copy_n(here_.x.data(), n(), D(0));
  std::copy_n(here_.z.data(), m(), D(0) + n());
  for (int k = 0; k < n(); ++k) D(1)[k] = dt_ * here_.xdot[k];
}

/// The differences for a step size `factor` times as large.
void BdfStepper::rescale(double factor) {
  const Mat RU = difference_matrix(order_, factor) * difference_matrix(order_, 1);
  Eigen::Map<Mat> all(differences_.data(), N_, order_ + 1);
  all = (all * RU).eval();
  dt_ *= factor;
  equal_steps_ = 0;
}

void BdfStepper::predict() {
  c_ = dt_ / alpha(order_);
  for (int k = 0; k < N_; ++k) {
    double sum = D(0)[k], psi = 0;
    for (int j = 1; j <= order_; ++j) {
      sum += D(j)[k];
      psi += D(j)[k] * harmonic[j];
    }
    const auto i = static_cast<std::size_t>(k);
    predicted_[i] = sum;
    psi_[i] = psi / alpha(order_);
    scale_[i] = scale(k, std::fabs(sum));
  }
}

/// The tolerance of unknown k, divided by dt per index.
double BdfStepper::scale(int k, double size) const {
  double result = weight(k, size);
  for (int level = 1; level < index_[k]; ++level) result /= std::min(1.0, dt_);
  return std::max(result, rounding_.least(k, dt_));
}

double BdfStepper::scaled_norm(const double* e, double factor) const {
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) sum.add(factor * e[k] / scale_[k]);
  return sum.norm(N_);
}

bool BdfStepper::evaluate_jacobian(double t) {
  double* at = problem_->unknowns();
  problem_->set_time(t);
  for (int k = 0; k < n(); ++k) at[k] = predicted_[k], at[n() + k] = psi_[k] / c_;
  for (int k = n(); k < N_; ++k) at[n() + k] = predicted_[k];
  entries_ = problem_->jacobian();
  ++stats_.jacobians;
  jacobian_current_ = true;
  factorised_for_ = 0;
  return std::all_of(entries_.begin(), entries_.end(), [](double e) { return std::isfinite(e); });
}

bool BdfStepper::factorise() {
  for (std::size_t k = 0; k < column_scale_.size(); ++k) column_scale_[k] = std::pow(c_, 1 - index_[k]);
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    matrix_[k] = in_mass_[k] ? entries_[k] / c_ : entries_[k];
    if (!column_scale_.empty()) matrix_[k] *= column_scale_[positions_[k].column];
  }
  ++stats_.factorisations;
  factorised_for_ = solver_.factorise(matrix_.data()) ? c_ : 0;
  return factorised_for_ != 0;
}

void BdfStepper::solve(double* right) {
  solver_.solve(right);
  for (std::size_t k = 0; k < column_scale_.size(); ++k) right[k] *= column_scale_[k];
}

/// Were the last corrections of an iteration that did not converge, or the error that was too large,
/// rounding?
RoundingFloor::Answer BdfStepper::at_rounding(double length) {
  constexpr double sums = 100;  // what differences and sums over the steps make of it
  std::vector<double> slopes(static_cast<std::size_t>(n()));
  for (std::size_t k = 0; k < slopes.size(); ++k) slopes[k] = (psi_[k] + d_[k]) / c_;
  const auto answer = rounding_.look({positions_, entries_, in_mass_, [&](double* right) { solve(right); }},
                                     y_.data(), slopes.data(), scale_, dt_, length, sums);
  if (rounding_.trouble > 0) trouble_ = rounding_text(rounding_, unknown_name(rounding_.worst));
  if (answer == RoundingFloor::Answer::accepted)
    newton_tolerance_ = std::max(newton_tolerance_, std::min(0.1, sums / 10 * rounding_.floor));
  return answer;
}

/// F(t, y⁰ + d, (ψ + d)/c) = 0 for d.
bool BdfStepper::newton(double t, bool& slow) {
  problem_->set_time(t);
  double* at = problem_->unknowns();
  std::fill(d_.begin(), d_.end(), 0.0);
  double before = 0;
  slow = false;
  for (iterations_ = 1; iterations_ <= most_iterations; ++iterations_) {
    for (int k = 0; k < N_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      y_[i] = predicted_[i] + d_[i];
      at[k < n() ? k : n() + k] = y_[i];
      if (k < n()) at[n() + k] = (psi_[i] + d_[i]) / c_;
    }
    problem_->residual(r_.data());
    ++stats_.evaluations, ++stats_.newton_iterations;
    double finite = 0;
    for (double r : r_) finite += r * 0;
    if (finite != 0) {
      trouble_ = "the equations are not finite near here";
      return false;
    }
    solve(r_.data());
    const double length = scaled_norm(r_.data(), 1);
    last_length_ = length;
    const double rate = iterations_ > 1 ? length / before : 0;
    const bool negligible = length <= 1e-3 * newton_tolerance_;  // whatever the rate: rounding has none
    if (iterations_ > 1 && !negligible &&
        (rate >= 1 ||
         std::pow(rate, most_iterations - iterations_) / (1 - rate) * length > newton_tolerance_))
      break;
    for (std::size_t i = 0; i < d_.size(); ++i) d_[i] -= r_[i];
    if (negligible || (iterations_ > 1 && rate / (1 - rate) * length < newton_tolerance_)) {
      for (std::size_t i = 0; i < d_.size(); ++i) y_[i] = predicted_[i] + d_[i];
      return true;
    }
    before = length;
  }
  slow = true;
  return false;
}

void BdfStepper::update_differences() {
  const double* d = d_.data();
  for (int k = 0; k < N_; ++k) {
    D(order_ + 2)[k] = d[k] - D(order_ + 1)[k];
    D(order_ + 1)[k] = d[k];
    for (int j = order_; j >= 0; --j) D(j)[k] += D(j + 1)[k];
  }
}

void BdfStepper::choose_order(double error) {
  if (equal_steps_ < order_ + 1) return;
  const double safety = 0.9 * (2 * most_iterations + 1) / (2 * most_iterations + iterations_);
  const auto factor = [](double e, int k) { return e > 0 ? std::pow(e, -1.0 / (k + 1)) : 10.0; };
  double best = factor(error, order_);
  int wanted = order_;
  if (order_ > 1)
    if (const double f = factor(scaled_norm(D(order_), error_constant(order_ - 1)), order_ - 1); f > best)
      best = f, wanted = order_ - 1;
  if (order_ < highest_)
    if (const double f = factor(scaled_norm(D(order_ + 2), error_constant(order_ + 1)), order_ + 1); f > best)
      best = f, wanted = order_ + 1;
  const double change = std::min(10.0, safety * best);
  if (wanted == order_ && change < 1.2 && change >= 0.9) return;
  order_ = wanted;
  rescale(std::min(change, limits_.dt_max / dt_));
}

void BdfStepper::set_end(double t) {
  next_.t = t;
  for (int k = 0; k < n(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    next_.x[k] = y_[i], next_.xdot[k] = (psi_[i] + d_[i]) / c_;
  }
  for (int k = n(); k < N_; ++k) next_.z[k - n()] = y_[k];
}

void BdfStepper::step(double end) {
  rejected_ = false;
  for (;;) {
    poll_interrupt();
    const double dt = fitted(dt_, end);
    if (dt != dt_) rescale(dt / dt_);
    dt_ = dt;
    if ((dt != end - here_.t || rejected_) && !is_visible(dt))
      throw vanished(Eigen::Map<const Vec>(d_.data(), trouble_.empty() ? N_ : 0),
                     trouble_.empty() && rounding_.raised() ? raised_text() : trouble_);
    trouble_.clear();
    const double t = dt == end - here_.t ? end : here_.t + dt;
    predict();
    bool slow = false, solved = false;
    for (int attempt = 0; attempt < 2 && !solved; ++attempt) {
      if (entries_.empty() || (attempt > 0 && !jacobian_current_)) {
        if (!evaluate_jacobian(t)) {
          trouble_ = "the equations are not finite near here";
          entries_.clear();
          break;
        }
      } else if (attempt > 0) {
        break;
      }
      if (factorised_for_ != c_ && !factorise()) {
        trouble_ = "the iteration matrix is singular";
        continue;
      }
      solved = newton(t, slow);
    }
    if (!solved && slow) {
      const RoundingFloor::Answer answer = at_rounding(last_length_);
      if (answer == RoundingFloor::Answer::raised) continue;
      solved = answer == RoundingFloor::Answer::accepted;
    }
    if (!solved) {
      ++stats_.rejected;
      rejected_ = true;
      rescale(slow ? 0.5 : 0.25);
      continue;
    }
    for (int k = 0; k < N_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      scale_[i] = scale(k, std::fabs(y_[i]));
    }
    const double error = scaled_norm(d_.data(), error_constant(order_));
    if (!(error <= 1)) {
      if (rounding_.has_multipliers() && at_rounding(error) == RoundingFloor::Answer::raised) continue;
      ++stats_.rejected;
      rejected_ = true;
      const double safety = 0.9 * (2 * most_iterations + 1) / (2 * most_iterations + iterations_);
      rescale(std::isfinite(error) ? std::max(0.2, safety * std::pow(error, -1.0 / (order_ + 1))) : 0.2);
      continue;
    }
    set_end(t);
    ++stats_.steps, ++equal_steps_;
    jacobian_current_ = false;
    update_differences();
    order_at_step_ = order_, kept_t_ = t, kept_dt_ = dt;
    kept_.assign(D(0), D(order_ + 1));
    choose_order(error);
    std::swap(before_, here_);
    std::swap(here_, next_);
    return;
  }
}

void BdfStepper::record(double* to) const {
  *to++ = order_at_step_, *to++ = kept_t_, *to++ = kept_dt_;
  std::copy(kept_.begin(), kept_.end(), to);
}

/// The polynomial through the last k + 1 points by its backward differences.
void BdfStepper::interpolate(const StepView& step, double t, Detail detail, Point& out) {
  if (t >= step.to.t) {
    out = step.to;
    return;
  }
  const int k = static_cast<int>(step.record[0]);
  const double end = step.record[1], dt = step.record[2];
  const double* differences = step.record + 3;
  out.t = t;
  out.x.resize(n()), out.xdot.resize(n()), out.z.resize(m());
  out.x.setZero(), out.xdot.setZero(), out.z.setZero();
  double factor = 1, slope = 0;
  for (int j = 0; j <= k; ++j) {
    if (j > 0) {
      const double u = ((t - end) / dt + j - 1) / j;
      slope = slope * u + factor / (j * dt);
      factor *= u;
    }
    const double* Dj = differences + static_cast<std::ptrdiff_t>(j) * N_;
    for (int i = 0; i < n(); ++i) out.x[i] += factor * Dj[i], out.xdot[i] += slope * Dj[i];
    for (int i = n(); i < N_; ++i) out.z[i - n()] += factor * Dj[i];
  }
  if (detail == Detail::full && determined_) derivative_(t, out.x.data(), out.xdot.data(), out.z.data());
}

}  // namespace pendula::integrate
