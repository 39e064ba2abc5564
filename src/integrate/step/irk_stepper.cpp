#include "integrate/step/irk_stepper.hpp"

#include <algorithm>
#include <cmath>

#include "base/interrupt.hpp"
#include "base/text.hpp"

namespace pendula::integrate {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr double safety = 0.9;
constexpr double order_up = 0.002, order_down = 0.8;  // contraction
constexpr double order_quotient_low = 0.8, order_quotient_high = 1.2;

}  // namespace

IrkStepper::IrkStepper(std::string name, ProblemPtr problem,
                       std::vector<std::shared_ptr<const IrkFormula>> formulas, std::vector<int> index,
                       Tolerances tolerances, StepLimits limits, Stats& stats)
    : Stepper(std::move(problem), std::move(tolerances), limits, stats),
      name_(std::move(name)),
      formulas_(std::move(formulas)),
      index_(std::move(index)),
      N_(n() + m()),
      derivative_(problem_, stats) {
  if (index_.empty()) index_.assign(static_cast<std::size_t>(N_), 1);
  rounding_ = RoundingFloor(index_, n());
  const bool high_index = std::any_of(index_.begin(), index_.end(), [](int i) { return i > 1; });
  bare_.assign(static_cast<std::size_t>(N_), high_index);
  for (const Problem::Entry& e : problem_->pattern()) {
    if (e.column >= n()) bare_[e.row] = false;
    const bool mass = e.column >= n() && e.column < 2 * n();
    in_mass_.push_back(mass);
    positions_.push_back({e.row, e.column < n() ? e.column : e.column - n()});
  }
  real_entries_.resize(positions_.size());
  complex_entries_.resize(positions_.size());
  matrices_.resize(formulas_.size());
  dense_.resize(formulas_.size());
  const auto size = static_cast<std::size_t>(N_);
  y_.resize(size), scale_.resize(size), inverse_scale_.resize(size), error_.resize(size),
      velocity_.resize(size), step_y_.resize(size);
  complex_right_.resize(size);
  for (Point* p : {&next_, &before_}) p->x.resize(n()), p->xdot.resize(n()), p->z.resize(m());
  use(first_level());
}

void IrkStepper::use(int level) {
  level_ = next_level_ = level;
  const auto stages = static_cast<std::size_t>(f().s), size = static_cast<std::size_t>(N_);
  for (auto* array : {&Z_, &R_, &transformed_}) array->assign(stages * size, 0.0);
  if (matrices().real.size() == 0) {
    matrices().real.analyse(N_, positions_);
    for (std::size_t k = 0; k < f().pairs.size(); ++k) {
      matrices().complex.emplace_back();
      matrices().complex.back().analyse(N_, positions_);
    }
  }
  lagrange_.resize(stages + 1), weights_.resize(stages);
  factorised_for_ = 0;
  since_order_change_ = 0;
  prepare_tolerances();
}

/// The estimate is of order s, the method of order 2s - 1: its tolerance is 0.1 tol^((s+1)/(2s)), as in
/// RADAU.
void IrkStepper::prepare_tolerances() {
  const bool high_index = std::any_of(index_.begin(), index_.end(), [](int i) { return i > 1; });
  const double power = (f().s + 1.0) / (2.0 * f().s);
  rtol_ = tolerances_.rtol, atol_ = tolerances_.atol;
  double smallest = 1;
  for (int i = 0; i < N_; ++i) {
    // atol alone where rtol is 0: the same law, relative to 1
    const double given = tolerances_.rtol[i] > 0 ? tolerances_.rtol[i] : tolerances_.atol[i];
    const double inner = f().s > 1 && !high_index ? std::min(0.1 * std::pow(given, power), 0.1) : given;
    rtol_[i] *= inner / given, atol_[i] *= inner / given;
    smallest = std::min(smallest, inner);
  }
  // What an iteration leaves in a constraint, a multiplier of index 3 sees h⁻² times in the next step.
  const int index = index_.empty() ? 1 : *std::max_element(index_.begin(), index_.end());
  const double loosest = std::pow(0.1, index - 1) * std::min(0.03, std::sqrt(smallest));
  newton_tolerance_ = std::max(10 * eps / smallest, loosest);
}

void IrkStepper::set_scales(double dt) {
  for (int i = 0; i < N_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    scale_[k] = atol_[i] + rtol_[i] * std::fabs(y_[k]);
    for (int level = 1; level < index_[k]; ++level) scale_[k] /= std::min(1.0, dt);
    if (rounding_.raised()) scale_[k] = std::max(scale_[k], rounding_.least(i, dt));
    inverse_scale_[k] = 1 / scale_[k];
  }
}

void IrkStepper::start(const Point& point, double end) {
  here_ = point;
  if (here_.xdot.size() == 0) here_.xdot = Vec::Zero(n());
  if (here_.z.size() == 0) here_.z = Vec::Zero(m());
  determined_ = std::all_of(index_.begin(), index_.end(), [](int i) { return i == 1; });
  determined_ = determined_ && derivative_.settle(here_);  // else x′ and z as the start gives them
  first_ = true, rejected_ = false, keep_ = false, jacobian_fresh_ = false;
  factorised_for_ = 0;
  contraction_ = 1, slow_factor_ = 0.5;
  rounding_.forget();
  old_dt_ = 0;
  newton_failures_ = 0;
  trouble_.clear();
  if (level_ != first_level()) use(first_level());
  dt_ = limits_.dt_first > 0 ? limits_.dt_first : cautious_step(end);
  prepare_code();
}

/// Order 9 from the start but for loose tolerances: on nine stiff problems it needs 5 … 25 % less time for
/// 4 … 6 digits than order 5 first.
int IrkStepper::first_level() const {
  constexpr double tight = 1e-4;
  return formulas_.size() > 1 && N_ > 0 && tolerances_.rtol.minCoeff() < tight ? 1 : 0;
}

/// next_ at the end of the step.
void IrkStepper::end_step(double dt) {
  const auto size = static_cast<std::size_t>(N_);
  const int s = f().s;
  next_.t = here_.t + dt;
  if (matrices().code) {
    std::copy_n(end_.y, n(), next_.x.data());
    std::copy_n(end_.y + n(), m(), next_.z.data());
    std::copy_n(end_.xdot, n(), next_.xdot.data());
    std::copy_n(end_.Z, Z_.size(), Z_.begin());
    return;
  }
  next_.x = Eigen::Map<const Vec>(y_.data(), n());
  next_.z = Eigen::Map<const Vec>(y_.data() + n(), m());
  next_.xdot.setZero();
  if (!f().stiffly_accurate) f().lagrange_slopes(1, lagrange_.data());
  for (int i = 0; i < s; ++i) {
    const double* Zi = Z_.data() + static_cast<std::size_t>(i) * size;
    const double weight = f().stiffly_accurate ? (i == s - 1 ? 1 : 0) : f().end[i];
    const double slope = f().stiffly_accurate ? f().W(s - 1, i) : lagrange_[static_cast<std::size_t>(i) + 1];
    if (weight != 0) {
      add_multiple(next_.x.data(), weight, Zi, n());
      add_multiple(next_.z.data(), weight, Zi + n(), m());
    }
    add_multiple(next_.xdot.data(), slope / dt, Zi, n());
  }
}

/// The new point; false if it is not finite or not on the constraints.
bool IrkStepper::complete(double dt) {
  end_step(dt);
  if (!next_.x.allFinite() || !next_.z.allFinite() || !next_.xdot.allFinite()) return false;
  bool moved = false;
  if (problem_->projects()) {
    try {
      moved = problem_->project_if_needed(next_.t, next_.x, tolerances_.rtol, tolerances_.atol, 0.1);
    } catch (const Failure& failure) {
      trouble_ = failure.what();
      return false;
    }
  }
  if (f().stiffly_accurate && !moved) return true;
  if (determined_ && !derivative_(next_.t, next_.x.data(), next_.xdot.data(), next_.z.data())) {
    trouble_ = derivative_.reason();
    return false;
  }
  return true;
}

std::string IrkStepper::blame() const {
  if (trouble_.empty() && rounding_.raised()) return raised_text();
  return trouble_.empty()
             ? "The solution is singular or not smooth here, or Newton's iteration does not converge"
             : trouble_;
}

void IrkStepper::step(double end) {
  std::copy_n(here_.x.data(), n(), y_.data());
  std::copy_n(here_.z.data(), m(), y_.data() + n());
  if (first_) prepare_tolerances();
  if (!keep_) jacobian_fresh_ = false;
  bool need_jacobian = !keep_ || entries_.empty();
  for (;;) {
    poll_interrupt();
    const double dt = fitted(dt_, end);
    if ((dt != end - here_.t || rejected_) && !is_visible(dt))
      throw vanished(Eigen::Map<const Vec>(error_.data(), trouble_.empty() ? N_ : 0), blame());
    trouble_.clear();
    if (need_jacobian && !evaluate_jacobian()) throw Failure(trouble_);
    if (need_jacobian || dt != factorised_for_) {
      if (!factorise(dt)) {
        reject(dt, -1);
        if (++newton_failures_ > 40) throw Failure(trouble_);
        continue;
      }
    }
    need_jacobian = false;
    set_scales(dt);
    start_iteration(dt);
    Newton outcome = newton(dt);
    const bool suspect = rounding_.has_multipliers() || newton_failures_ >= 3;
    if (suspect && (outcome == Newton::slow || outcome == Newton::diverged)) {
      const RoundingFloor::Answer answer = at_rounding(dt, last_length_);
      if (answer == RoundingFloor::Answer::raised) continue;
      if (answer == RoundingFloor::Answer::accepted) outcome = Newton::converged;
    }
    if (outcome != Newton::converged) {
      need_jacobian = !jacobian_fresh_;
      ++newton_failures_;
      reject(dt, outcome == Newton::slow ? -2 : -1);
      continue;
    }
    const double error = error_norm(dt, first_ || rejected_);
    if (error >= 1 && rounding_.has_multipliers() && at_rounding(dt, error) == RoundingFloor::Answer::raised)
      continue;
    if (error >= 1 || !(error < 1) || !complete(dt)) {
      need_jacobian = !jacobian_fresh_;
      reject(dt, error >= 1 ? error : -1);
      continue;
    }
    choose_next(dt, error);
    if (dt == end - here_.t) next_.t = end;
    step_dt_ = dt, step_t_ = here_.t;
    step_y_ = y_;
    old_Z_.swap(Z_);
    Z_.resize(old_Z_.size());
    old_level_ = level_, old_dt_ = dt;
    std::swap(before_, here_);
    std::swap(here_, next_);
    if (next_.x.size() == 0) next_ = here_;
    ++stats_.steps;
    if (next_level_ != level_) use(next_level_);
    return;
  }
}

void IrkStepper::reject(double dt, double error) {
  ++stats_.rejected;
  rejected_ = true;
  keep_ = false;
  if (error == -2) {
    dt_ = dt * slow_factor_;
  } else if (error < 0) {
    dt_ = dt / 2;
  } else if (first_) {
    dt_ = dt / 10;
  } else {
    const int s = f().s, most = 7 + (s - 3) * 5 / 2;
    const double factor = std::min(safety, safety * (1 + 2.0 * most) / (iterations_ + 2 * most));
    dt_ = dt / std::clamp(root(error, s + 1) / factor, 1.0, 5.0);
  }
  if (error >= 0 || level_ == 0) return;
  if (newton_failures_ >= 4) {  // a lower order has smaller systems to converge
    use(level_ - 1);
    newton_failures_ = 0;
    rejected_ = true;
  }
}

/// Gustafsson's predictive controller; the step stays as it is when that saves factorisations.
void IrkStepper::choose_next(double dt, double error) {
  const int s = f().s, most = 7 + (s - 3) * 5 / 2;
  const double factor = std::min(safety, safety * (1 + 2.0 * most) / (iterations_ + 2 * most));
  constexpr double smallest = 1.0 / 8, largest = 5;
  double quotient = std::clamp(root(error, s + 1) / factor, smallest, largest);
  if (!first_ && accepted_dt_ > 0) {
    const double predicted = accepted_dt_ / dt * root(error * error / accepted_error_, s + 1) / safety;
    quotient = std::max(quotient, std::clamp(predicted, smallest, largest));
  }
  accepted_dt_ = dt;
  accepted_error_ = std::max(1e-2, error);
  double proposed = dt / quotient;
  if (rejected_) proposed = std::min(proposed, dt);
  const bool shortened = dt < 0.99 * dt_;
  first_ = rejected_ = false;
  newton_failures_ = 0;
  keep_ = theta_ <= keep_jacobian_below;
  jacobian_fresh_ = false;
  const double change = proposed / dt;
  if (keep_ && change >= 1 && change <= 1.2 && factorised_for_ == dt) proposed = dt;
  dt_ = shortened ? std::max(proposed, dt_) : proposed;
  choose_order(change);
}

void IrkStepper::choose_order(double change) {
  ++since_order_change_;
  const int top = static_cast<int>(formulas_.size()) - 1;
  const bool calm = change > order_quotient_low && change < order_quotient_high;
  int wanted = level_;
  if (level_ < top && since_order_change_ >= 10 && theta_ <= order_up && calm) wanted = level_ + 1;
  if (level_ > 0 && since_order_change_ >= 3 && theta_ >= order_down) wanted = level_ - 1;
  if (wanted == level_) return;
  next_level_ = wanted;  // step() changes over when the stages have been kept for the continuous extension
}

std::size_t IrkStepper::record_size() const { return 3 + step_y_.size() + old_Z_.size(); }

void IrkStepper::record(double* to) const {
  *to++ = old_level_, *to++ = step_t_, *to++ = step_dt_;
  to = std::copy(step_y_.begin(), step_y_.end(), to);
  std::copy(old_Z_.begin(), old_Z_.end(), to);
}

void IrkStepper::interpolate(const StepView& step, double t, Detail detail, Point& out) {
  if (t >= step.to.t) {
    out = step.to;
    return;
  }
  const double* record = step.record;
  const auto level = static_cast<std::size_t>(*record++);
  const double t0 = *record++, dt = *record++;
  const double *y = record, *Z = record + N_;
  const IrkFormula& formula = *formulas_[level];
  std::vector<double> l(static_cast<std::size_t>(formula.s) + 1), slopes(l.size());
  formula.lagrange((t - t0) / dt, l.data());
  formula.lagrange_slopes((t - t0) / dt, slopes.data());
  out.t = t;
  out.x.resize(n()), out.xdot.resize(n()), out.z.resize(m());
  for (int k = 0; k < N_; ++k) {
    double value = y[k], slope = 0;  // the polynomials add up to 1
    for (int j = 0; j < formula.s; ++j) {
      value += l[static_cast<std::size_t>(j) + 1] * Z[j * N_ + k];
      slope += slopes[static_cast<std::size_t>(j) + 1] * Z[j * N_ + k];
    }
    if (k >= n()) {
      out.z[k - n()] = value;
      continue;
    }
    out.x[k] = value;
    out.xdot[k] = slope / dt;
  }
  if (detail == Detail::sketch) return;
  refine(step, level, t, out);
}

/// The method itself from the beginning of the step to t: of the order of the method, where that is
/// affordable.
void IrkStepper::refine(const StepView& step, std::size_t level, double t, Point& out) {
  constexpr int affordable = 150;
  const IrkFormula& formula = *formulas_[level];
  if (formula.s * N_ <= affordable) {
    if (!dense_[level]) dense_[level] = std::make_shared<RungeKutta>(problem_, formula.tableau, !determined_);
    Point better;
    try {
      dense_[level]->step(step.from, t - step.from.t, better, false);
      better.t = t;
      out = better;
      return;
    } catch (const Failure&) {  // the polynomial stays
    }
  }
  if (determined_) derivative_(t, out.x.data(), out.xdot.data(), out.z.data());
}

}  // namespace pendula::integrate
