#include "integrate/step/irk_stepper.hpp"

#include <algorithm>
#include <cmath>

#include "base/epsilon.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/solve/vector_sums.hpp"

namespace pendula::integrate {
namespace {

// of the contraction, and of successive steps: Hairer & Wanner, J. Comput. Appl. Math. 111, 1999 (RADAU)
constexpr double order_up = 0.002, order_down = 0.8;
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
      rhs_(problem_, stats),
      driven_(contains_time(*problem_)),
      check_(*problem_),
      pulses_(n(), m()) {
  if (index_.empty()) index_.assign(static_cast<std::size_t>(N_), 1);
  rounding_ = RoundingFloor(index_, n());
  const bool high_index = std::any_of(index_.begin(), index_.end(), [](int i) { return i > 1; });
  rows_.returning = check_.slopes_return();
  rows_.bare.assign(static_cast<std::size_t>(N_), high_index);
  for (const Problem::Entry& e : problem_->pattern()) {
    if (e.column >= n()) rows_.bare[e.row] = false;
    const bool mass = e.column >= n() && e.column < 2 * n();
    rows_.in_mass.push_back(mass);
    rows_.positions.push_back({e.row, e.column < n() ? e.column : e.column - n()});
  }
  shifted_.real.resize(rows_.positions.size());
  shifted_.complex.resize(rows_.positions.size());
  matrices_.resize(formulas_.size());
  const auto size = static_cast<std::size_t>(N_);
  for (auto* v : {&y_, &scales_.scale, &scales_.inverse, &error_, &work_.velocity, &last_.y}) v->resize(size);
  shifted_.right.resize(size);
  for (Point* p : {&next_, &before_}) {
    p->x.resize(n());
    p->xdot.resize(n());
    p->z.resize(m());
  }
  use(first_level());
}

void IrkStepper::use(int level) {
  order_.level = order_.next = level;
  const auto stages = static_cast<std::size_t>(f().s), size = static_cast<std::size_t>(N_);
  for (auto* array : {&Z_, &work_.R, &work_.transformed}) array->assign(stages * size, 0.0);
  if (matrices().real.size() == 0) matrices().real.analyse(N_, rows_.positions);
  work_.lagrange.resize(stages + 1);
  work_.weights.resize(stages);
  work_.residual.resize(size);
  jacobian_.factorised_for = 0;
  order_.since_change = 0;
  prepare_tolerances();
}

/// Tolerances of the error estimate. The estimate has order s, the method order 2s - 1, hence 0.1
/// tol^((s+1)/(2s)) as in RADAU. Where stiffness reduces the order to s, that of the stages, error and
/// estimate are of similar size; therefore at most forty times the tolerance. (No effect at 1e-6; without it
/// HIRES at 1e-12 has an error of 4e-9.)
void IrkStepper::prepare_tolerances() {
  constexpr double most = 40;
  const bool high_index = std::any_of(index_.begin(), index_.end(), [](int i) { return i > 1; });
  const double power = (f().s + 1.0) / (2.0 * f().s);
  scales_.rtol = tolerances_.rtol;
  scales_.atol = tolerances_.atol;
  double smallest = 1;
  for (int i = 0; i < N_; ++i) {
    // where rtol is 0, the same law for atol, relative to 1
    const double given = tolerances_.rtol[i] > 0 ? tolerances_.rtol[i] : tolerances_.atol[i];
    const double relaxed = std::min({0.1 * std::pow(given, power), 0.1, most * given});
    const double inner = f().s > 1 && !high_index ? relaxed : given;
    scales_.rtol[i] *= inner / given;
    scales_.atol[i] *= inner / given;
    smallest = std::min(smallest, inner);
  }
  // an index-3 multiplier contains the iteration error of a constraint times h⁻²
  const int index = index_.empty() ? 1 : *std::max_element(index_.begin(), index_.end());
  iteration_.tolerance = newton_tolerance(smallest, std::pow(0.1, index - 1));
}

void IrkStepper::set_scales(double dt) {
  for (int i = 0; i < N_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    scales_.scale[k] = scales_.atol[i] + scales_.rtol[i] * std::fabs(y_[k]);
    if (index_[k] > 1) scales_.scale[k] *= tolerances_.relaxation(i, index_[k], dt);
    if (rounding_.raised())
      scales_.scale[k] = std::max(scales_.scale[k], rounding_.least(i, dt, tolerances_));
    scales_.inverse[k] = 1 / scales_.scale[k];
  }
}

void IrkStepper::start(const Point& point, double end) {
  here_ = point;
  if (here_.xdot.size() == 0) here_.xdot = Vec::Zero(n());
  if (here_.z.size() == 0) here_.z = Vec::Zero(m());
  determined_ = std::all_of(index_.begin(), index_.end(), [](int i) { return i == 1; });
  determined_ = determined_ && rhs_.settle(here_);  // otherwise x′ and z as given by the start
  control_.start();
  jacobian_.keep = jacobian_.fresh = false;
  jacobian_.factorised_for = 0;
  iteration_.contraction = 1;
  iteration_.slow_factor = 0.5;
  iteration_.failures = iteration_.checks_due = 0;
  rounding_.forget();
  last_.dt = 0;
  pulses_.start(here_.z);
  trouble_.clear();
  if (order_.level != first_level()) use(first_level());
  dt_ = limits_.dt_first > 0 ? limits_.dt_first : cautious_step(end);
  prepare_code();
}

/// Order 9 from the start except for loose tolerances: for 4 … 6 digits on nine stiff problems it takes 5 …
/// 25 % less time than starting with order 5.
int IrkStepper::first_level() const {
  constexpr double tight = 1e-4;
  return formulas_.size() > 1 && N_ > 0 && tolerances_.rtol.minCoeff() < tight ? 1 : 0;
}

/// Writes the end of the step to next_.
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
  if (!f().stiffly_accurate) f().lagrange_slopes(1, work_.lagrange.data());
  for (int i = 0; i < s; ++i) {
    const double* Zi = Z_.data() + static_cast<std::size_t>(i) * size;
    const double weight = f().stiffly_accurate ? (i == s - 1 ? 1 : 0) : f().end[i];
    const double slope = f().stiffly_accurate ? f().W(s - 1, i) : work_.lagrange[i + 1];
    if (weight != 0) {
      add_multiple(next_.x.data(), weight, Zi, n());
      add_multiple(next_.z.data(), weight, Zi + n(), m());
    }
    add_multiple(next_.xdot.data(), slope / dt, Zi, n());
  }
}

/// Computes the new point; false if it is not finite or cannot be projected onto the constraints.
bool IrkStepper::complete(double dt) {
  end_step(dt);
  if (!next_.x.allFinite() || !next_.z.allFinite() || !next_.xdot.allFinite()) return false;
  const std::optional<bool> moved = project(next_);
  if (!moved) return false;
  if (f().stiffly_accurate && !*moved) return true;
  std::copy_n(next_.xdot.data(), n(), work_.velocity.data());
  if (determined_ && !rhs_(next_.t, next_.x.data(), next_.xdot.data(), next_.z.data())) {
    trouble_ = rhs_.reason();
    return false;
  }
  return true;
}

std::string IrkStepper::blame() const {
  if (trouble_.empty() && rounding_.raised()) return raised_text();
  if (trouble_.empty() && !determined_ && !f().stiffly_accurate)  // |R(∞)| = 1 for errors of such unknowns
    return text("The equations determine some derivatives only together with their own derivatives, and ",
                name_, " does not damp errors of such unknowns; take method = \"radau\" or \"bdf\"");
  return trouble_.empty()
             ? "The solution is singular or not smooth here, or Newton's iteration does not converge"
             : trouble_;
}

void IrkStepper::begin_at_here() {
  std::copy_n(here_.x.data(), n(), y_.data());
  std::copy_n(here_.z.data(), m(), y_.data() + n());
}

void IrkStepper::step(double end) {
  begin_at_here();
  if (control_.first) prepare_tolerances();
  if (!jacobian_.keep) jacobian_.fresh = false;
  bool need_jacobian = !jacobian_.keep || jacobian_.entries.empty();
  bool behind_kink = false;
  for (int rejections = 0;; ++rejections) {
    poll_interrupt();
    if (rejections == suspicious_failures && check_.has_algebraic()) {
      last_.distrusted = true;  // the equations may be of another size where the step ends
      if (determined_ && settle_again(rhs_)) {
        begin_at_here();
        need_jacobian = true;
      }
    }
    const double dt = fitted(dt_, end);
    if ((dt != end - here_.t || control_.repeated) && !is_visible(dt))
      throw vanished(Eigen::Map<const Vec>(error_.data(), trouble_.empty() ? N_ : 0), blame());
    trouble_.clear();
    if (need_jacobian && !evaluate_jacobian(behind_kink ? dt : 0)) throw Failure(trouble_);
    if (need_jacobian || dt != jacobian_.factorised_for) {
      if (!factorise(dt)) {
        reject(dt, Rejection::unsolvable);
        if (++iteration_.failures > 40) throw Failure(trouble_);
        continue;
      }
    }
    need_jacobian = false;
    set_scales(dt);
    start_iteration(dt);
    Newton outcome = newton(dt);
    const bool suspect = rounding_.has_multipliers() || iteration_.failures >= 3;
    if (suspect && (outcome == Newton::slow || outcome == Newton::diverged)) {
      const RoundingFloor::Answer answer = at_rounding(dt, iteration_.length);
      if (answer == RoundingFloor::Answer::raised) continue;
      if (answer == RoundingFloor::Answer::accepted) outcome = Newton::converged;
    }
    if (outcome != Newton::converged) {
      // The slope of the equations may double between here and the end, as at a kink. With the slopes here
      // the iteration then oscillates at any step size; with those after the kink it converges.
      constexpr int shortened = 3;
      ++iteration_.failures;
      iteration_.prediction.failed();
      behind_kink = outcome == Newton::slow && iteration_.failures >= shortened && !behind_kink;
      need_jacobian = !jacobian_.fresh || iteration_.failures >= shortened;
      reject(dt, outcome == Newton::slow ? Rejection::slow : Rejection::unsolvable);
      continue;
    }
    const double error = error_norm(dt, control_.first || control_.repeated);
    if (error >= 1 && rounding_.may_raise(control_.repeated) &&
        at_rounding(dt, error) == RoundingFloor::Answer::raised)
      continue;
    if (error >= 1 || !(error < 1) || !complete(dt)) {
      need_jacobian = !jacobian_.fresh;
      reject(dt, error >= 1 ? Rejection::error : Rejection::unsolvable, error);
      continue;
    }
    const double correction = correction_at_end(dt);
    if (const double more =
            std::max({correction, stiff_error_at_end(dt), missed_between_stages(dt), unresolved(dt)});
        more >= 1) {
      need_jacobian = !jacobian_.fresh;
      reject(dt, Rejection::error, more);
      continue;
    }
    return accept(dt, error, end);
  }
}

/// Reduced by the number of iterations used: fewer iterations allow longer steps.
double IrkStepper::safety_factor() const {
  constexpr double safety = PredictiveController::safety;
  const int most = most_iterations();
  return std::min(safety, safety * (1 + 2.0 * most) / (iteration_.count + 2 * most));
}

void IrkStepper::reject(double dt, Rejection why, double error) {
  ++stats_.rejected;
  control_.repeated = true;
  jacobian_.keep = false;
  if (why == Rejection::error) {
    dt_ = control_.first ? dt / 10 : dt / std::clamp(root(error, f().s + 1) / safety_factor(), 1.0, 5.0);
    return;
  }
  dt_ = why == Rejection::slow ? dt * iteration_.slow_factor : dt / 2;
  if (order_.level > 0 && iteration_.failures >= 4) {  // a lower order has smaller systems to converge
    use(order_.level - 1);
    iteration_.failures = 0;
  }
}

double IrkStepper::distance_to_last_stage() const {
  const double* Z = Z_.data() + Z_.size() - static_cast<std::size_t>(N_);
  ErrorSum sum;
  for (int k = 0; k < N_; ++k) sum.add(Z[k] * scales_.inverse[k]);
  return sum.norm(N_);
}

/// Accepts the step and chooses size and order of the next one. The size is kept if
/// that saves factorisations.
void IrkStepper::accept(double dt, double error, double end) {
  const double quotient = control_.quotient(dt, error, f().s + 1, safety_factor(), 1.0 / 8, 5);
  double proposed = control_.propose(dt, quotient);
  last_.repeated = control_.repeated;
  control_.accept(dt, error);
  iteration_.failures = 0;
  check_.accept();
  pulses_.accept();
  jacobian_.keep = iteration_.theta <= keep_jacobian_below;
  jacobian_.fresh = false;
  constexpr double worth_a_factorisation = 1.2;  // of the step size: as in RADAU5
  const double change = proposed / dt;
  if (jacobian_.keep && change >= 1 && change <= worth_a_factorisation && jacobian_.factorised_for == dt)
    proposed = dt;
  dt_ = dt < as_planned * dt_ ? std::max(proposed, dt_) : proposed;
  choose_order(change);
  if (dt == end - here_.t) next_.t = end;
  last_.t = here_.t;
  last_.dt = dt;
  last_.distance = distance_to_last_stage();
  last_.distrusted = false;
  last_.level = order_.level;
  last_.y = y_;
  last_.Z.swap(Z_);
  Z_.resize(last_.Z.size());
  std::swap(before_, here_);
  std::swap(here_, next_);
  if (next_.x.size() == 0) next_ = here_;
  ++stats_.steps;
  if (stats_.steps * N_ <= 4 * few_values && f().s * N_ <= affordable)
    doubtful_steps_.push_back({before_.t, error});
  stats_.errors += error;
  if (order_.next != order_.level) use(order_.next);
}

void IrkStepper::choose_order(double change) {
  ++order_.since_change;
  const int top = static_cast<int>(formulas_.size()) - 1;
  const bool size_is_steady = change > order_quotient_low && change < order_quotient_high;
  int wanted = order_.level;
  if (order_.level < top && order_.since_change >= 10 && iteration_.theta <= order_up && size_is_steady)
    wanted = order_.level + 1;
  if (order_.level > 0 && order_.since_change >= 3 && iteration_.theta >= order_down)
    wanted = order_.level - 1;
  if (wanted == order_.level) return;
  order_.next = wanted;  // changed in step(), once the stages have been stored for the continuous extension
}

std::size_t IrkStepper::record_size() const { return 3 + last_.y.size() + last_.Z.size(); }

void IrkStepper::record(double* to) const {
  *to++ = last_.level;
  *to++ = last_.t;
  *to++ = last_.dt;
  to = std::copy(last_.y.begin(), last_.y.end(), to);
  std::copy(last_.Z.begin(), last_.Z.end(), to);
}

Detail IrkStepper::look(const StepView& step, double t, Detail detail, Point& out) {
  error_inside_ = 0;
  if (t >= step.to.t) {
    out = step.to;
    return Detail::full;
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
  out.x.resize(n());
  out.xdot.resize(n());
  out.z.resize(m());
  for (int k = 0; k < N_; ++k) {
    double value = y[k], slope = 0;  // the Lagrange polynomials sum to 1
    for (int j = 0; j < formula.s; ++j) {
      value += l[j + 1] * Z[j * N_ + k];
      slope += slopes[j + 1] * Z[j * N_ + k];
    }
    if (k >= n()) {
      out.z[k - n()] = value;
      continue;
    }
    out.x[k] = value;
    out.xdot[k] = slope / dt;
  }
  if (detail == Detail::coarse) return detail;
  refine(step, static_cast<int>(level), t, out);
  return Detail::full;
}

/// Evaluates inside a step by a step of the method itself from its beginning to t, at the full order, if the
/// model is small enough.
void IrkStepper::refine(const StepView& step, int level, double t, Point& out) {
  if (formulas_[level]->s * N_ <= affordable) {
    const bool reached = inside().reaches(step, level, t);
    if (reached) error_inside_ = departure(step, out, inside().next_);
    if (reached && !is_doubtful()) {
      out = inside().next_;
      out.t = t;
      return;
    }
  }  // else the polynomial stays
  if (determined_) rhs_(t, out.x.data(), out.xdot.data(), out.z.data());
}

/// A step from the beginning of the given one to t, into next_. Starting values come from its collocation
/// polynomial, and Newton's iteration continues to the rounding level so that neighbouring values are smooth.
bool IrkStepper::reaches(const StepView& step, int level, double t) {
  constexpr double sharper = 1e-6, nearly = 1e-2;  // of the tolerance of a step
  if (order_.level != level) use(level);
  here_ = step.from;
  std::copy_n(here_.x.data(), n(), y_.data());
  std::copy_n(here_.z.data(), m(), y_.data() + n());
  const double dt = dt_ = t - here_.t;
  if (!matrices().code) prepare_code();
  if (!evaluate_jacobian() || !factorise(dt)) return false;
  set_scales(dt);
  const double *record = step.record + 3, *Z = record + N_;  // record(): level, t, dt, y, Z
  for (int i = 0; i < f().s; ++i) {
    f().lagrange((here_.t + f().c[i] * dt - step.record[1]) / step.record[2], work_.lagrange.data());
    double* Zi = Z_.data() + static_cast<std::ptrdiff_t>(i) * N_;
    for (int k = 0; k < N_; ++k) Zi[k] = record[k] - y_[k];
    combine(N_, Zi, std::span<const double>(work_.lagrange).subspan(1, static_cast<std::size_t>(f().s)), Z,
            N_, Zi);
  }
  CompiledNewtonStep* code = matrices().code.get();
  if (code) {
    code->begin(*problem_, here_.t, dt, y_.data(), scales_.scale.data());
    code->set(Z_.data());
  }
  const double enough = iteration_.tolerance;
  iteration_.contraction = 1;
  const double relative = std::max(scales_.rtol.maxCoeff(), scales_.atol.maxCoeff());
  iteration_.tolerance = std::clamp(100 * eps / relative, sharper * enough, enough);
  const Newton outcome = newton(dt);
  iteration_.tolerance = enough;
  const bool close = outcome != Newton::not_finite && iteration_.length <= nearly * enough;
  if (outcome != Newton::converged && !close) return false;
  if (code) end_ = code->end();
  return complete(dt);
}

}  // namespace pendula::integrate
