#include "integrate/step/rosenbrock_stepper.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_set>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/model/first_order.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/compiled/step_cache.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/solve/error_sizes.hpp"
#include "integrate/solve/vector_sums.hpp"

namespace pendula::integrate {
namespace {

/// unknowns; in larger models the equations dominate, and finding pivots takes long
constexpr int largest_coded = 60;

/// ∂F/∂t.
struct TimeSlopes {
  codegen::Kernel kernel;
  bool any;  ///< whether some are nonzero or unknown
};

TimeSlopes time_slopes(const Problem& problem) {
  const dae::FirstOrder& model = problem.model();
  std::vector<Expr> slopes;
  for (Expr e : model.F) slopes.push_back(partial(e, time_symbol()));
  const bool any =
      !model.u.empty() || std::any_of(slopes.begin(), slopes.end(), [](Expr e) { return !e.is_zero(); });
  return {codegen::Kernel(slopes, problem.arguments()), any};
}

/// The first row with a factor of x′ that depends on more than parameters.
std::optional<int> row_without_constant_mass(const Problem& problem) {
  const int n = problem.n();
  const std::unordered_set<Expr> fixed(problem.model().p.begin(), problem.model().p.end());
  for (std::size_t k = 0; k < problem.pattern().size(); ++k) {
    const Problem::Entry e = problem.pattern()[k];
    if (e.column < n || e.column >= 2 * n) continue;
    for (Expr leaf : leaves({&problem.partials()[k], 1}))
      if (!fixed.count(leaf) && symbol_of(leaf).kind != Kind::constant) return e.row;
  }
  return {};
}

}  // namespace

RosenbrockStepper::RosenbrockStepper(ProblemPtr problem, RosenbrockPtr method, Tolerances tolerances,
                                     StepLimits limits, Stats& stats)
    : Stepper(std::move(problem), std::move(tolerances), limits, stats),
      method_(std::move(method)),
      N_(n() + m()),
      rhs_(problem_, stats),
      check_(*problem_),
      pulses_(n(), m()) {
  if (!method_->e())
    throw Error(text("the method ", method_->name(), " has no embedded method to estimate its error"));
  if (!method_->error_estimate_sees_linear())
    throw Error(text("the error estimate of ", method_->name(),
                     " is zero for every linear equation: it cannot choose steps; take method = \"rodas\""));
  require_constant_mass();
  for (int i = 0; i < method_->stages(); ++i) {
    sums_.A.push_back(row_of(method_->A(), i, i));
    sums_.C.push_back(row_of(-method_->C(), i, i));
    sums_.m.push_back(method_->m()[i]);
    sums_.e.push_back((*method_->e())[i]);
  }
  for (int r = 0; r < method_->dense().rows(); ++r)
    sums_.dense.push_back(row_of(method_->dense(), r, method_->stages()));
  rows_.in_mass_row.assign(static_cast<std::size_t>(N_), false);
  for (const Problem::Entry& e : problem_->pattern()) {
    const bool mass = e.column >= n() && e.column < 2 * n();
    rows_.in_mass.push_back(mass);
    if (mass) rows_.in_mass_row[e.row] = true;
    rows_.positions.push_back({e.row, e.column < n() ? e.column : e.column - n()});
  }
  matrix_.resize(rows_.positions.size());
  solver_.analyse(N_, rows_.positions);
  static PerEquations<TimeSlopes> known;
  const TimeSlopes& slopes = known.of(*problem_, [&] { return time_slopes(*problem_); });
  depends_on_time_ = slopes.any;
  time_kernel_ = slopes.kernel;
  const auto size = static_cast<std::size_t>(N_);
  for (auto* v : {&y_, &Ft_, &R_, &scaled_, &at_end_.undamped, &at_end_.weights, &at_end_.bounds})
    v->assign(size, 0.0);
  U_.assign(size * static_cast<std::size_t>(method_->stages()), 0.0);
  last_.dense.assign(size * (2 + static_cast<std::size_t>(method_->dense().rows())), 0.0);
  for (Point* p : {&next_, &before_}) {
    p->x.resize(n());
    p->xdot.resize(n());
    p->z.resize(m());
  }
}

void RosenbrockStepper::require_constant_mass() const {
  static PerEquations<std::optional<int>> known;
  const auto row = known.of(*problem_, [&] { return row_without_constant_mass(*problem_); });
  if (row)
    throw Error(text("the method ", method_->name(), " needs M x′ = f with a constant M, but ",
                     problem_->equation_name(*row), " is not of this form; use method = \"radau\""));
}

void RosenbrockStepper::start(const Point& point, double end) {
  here_ = point;
  rhs_.settle(here_);  // otherwise x′ and z as given by the start
  control_.start();
  trouble_.clear();
  entries_at_ = NAN;
  last_.dt = 0;
  pulses_.start(here_.z);
  dt_ = limits_.dt_first > 0 ? limits_.dt_first : cautious_step(end);
  prepare_code();
}

/// Compiles code for whole steps, with pivots for the Jacobian at the start.
void RosenbrockStepper::prepare_code() {
  if (N_ > largest_coded || code_) return;
  begin_step();
  if (factorise(dt_) && solver_.straight() == nullptr) solver_.prepare(matrix_.data());
  if (factorise(dt_)) use_code();
}

bool RosenbrockStepper::use_code() {
  if (N_ <= largest_coded && solver_.straight())
    code_ =
        CompiledRosenbrockStep::make({*problem_, *method_, rows_.in_mass, *solver_.straight(), tolerances_});
  return code_ != nullptr;
}

/// Evaluates ∂F/∂t at a point, unless the code does that; false if it is not finite.
bool RosenbrockStepper::time_derivative(const Point& at) {
  if (!depends_on_time_ || (code_ && problem_->model().u.empty())) return true;
  problem_->set_point(at.t, at.x.data(), at.xdot.data(), at.z.data());
  if (problem_->model().u.empty()) {
    time_kernel_(problem_->values().data(), Ft_.data());
  } else {  // inputs may be functions of numbers only
    // √ε, as in RODAS (Hairer & Wanner II, §IV.7)
    const double delta = 1e-8 * std::max(1e-5, std::fabs(at.t) + dt_);
    problem_->residual(R_.data());
    problem_->set_time(at.t + delta);
    problem_->residual(Ft_.data());
    problem_->set_time(at.t);
    for (std::size_t k = 0; k < Ft_.size(); ++k) Ft_[k] = (Ft_[k] - R_[k]) / delta;
    stats_.evaluations += 2;
  }
  trouble_ = "the derivative of the equations with respect to t is not finite";
  if (!std::all_of(Ft_.begin(), Ft_.end(), [](double v) { return std::isfinite(v); })) return false;
  trouble_.clear();
  return true;
}

void RosenbrockStepper::begin_step() {
  std::copy_n(here_.x.data(), n(), y_.data());
  std::copy_n(here_.z.data(), m(), y_.data() + n());
  if (code_) {
    ++stats_.jacobians;
  } else if (entries_at_ != here_.t) {
    keep_jacobian(here_, entries_);
  }
}

/// Attempts a step of this size; returns the norm of its error, or NaN.
double RosenbrockStepper::attempt(double dt) {
  if (!code_) return attempt_apart(dt);
  end_ = code_->run(*problem_, here_, dt, Ft_.data());
  if (end_.regular) {
    ++stats_.factorisations;
    stats_.evaluations += method_->stages();
    std::copy_n(end_.scaled, N_, scaled_.data());
    std::copy_n(end_.undamped, N_, at_end_.undamped.data());
    const double error = ErrorSum::norm(end_.sum, end_.largest, N_);
    if (std::isfinite(error)) return error;
  }
  code_ = nullptr;  // the pivots do not suit, or a value is not finite
  begin_step();
  return attempt_apart(dt);
}

/// Requires finite entries: with an infinite ∂f/∂x at the border of a domain the solution would not move.
bool RosenbrockStepper::jacobian_is_finite() {
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    if (std::isfinite(entries_[k])) continue;
    trouble_ = text("the Jacobian of ", problem_->equation_name(rows_.positions[k].row), " is not finite");
    return false;
  }
  return true;
}

/// Evaluates the derivatives at the beginning of the step or, where they are infinite, near it.
bool RosenbrockStepper::linearise() {
  if (entries_at_ != here_.t) keep_jacobian(here_, entries_);
  if (jacobian_is_finite() && time_derivative(here_)) return true;
  const bool found = take_beside([&](const Point& at) {
    keep_jacobian(at, entries_);
    return jacobian_is_finite() && time_derivative(at);
  });
  entries_at_ = NAN;
  return found;
}

double RosenbrockStepper::attempt_apart(double dt) {
  if (!linearise()) return NAN;
  if (!factorise(dt)) {
    trouble_ = "the matrix of the linear systems is singular";
    return NAN;
  }
  if (stages(dt)) return error_norm();
  trouble_ = "the equations are not finite near here";
  return NAN;
}

bool RosenbrockStepper::factorise(double dt) {
  const double factor = 1 / (method_->gamma() * dt);
  for (std::size_t k = 0; k < entries_.size(); ++k)
    matrix_[k] = rows_.in_mass[k] ? factor * entries_[k] : entries_[k];
  ++stats_.factorisations;
  return solver_.factorise(matrix_.data());
}

bool RosenbrockStepper::stages(double dt) {
  const auto size = static_cast<std::size_t>(N_);
  const int s = method_->stages(), states = n();
  double* at = problem_->unknowns();
  std::fill(at_end_.undamped.begin(), at_end_.undamped.end(), 0.0);
  for (int i = 0; i < s; ++i) {
    problem_->set_time(here_.t + method_->alpha()[i] * dt);
    const auto stride = static_cast<std::ptrdiff_t>(size);
    combine(states, y_.data(), sums_.A[i], U_.data(), stride, at);
    combine(states, nullptr, sums_.C[i], U_.data(), stride, at + states);
    for (int k = 0; k < states; ++k) at[states + k] /= dt;
    combine(N_ - states, y_.data() + states, sums_.A[i], U_.data() + states, stride, at + 2 * states);
    double* u = U_.data() + static_cast<std::size_t>(i) * size;
    problem_->residual(u);
    ++stats_.evaluations;
    const double factor = depends_on_time_ ? method_->gammas()[i] * dt : 0, e = sums_.e[i];
    double* const undamped = at_end_.undamped.data();
    for (std::size_t k = 0; k < size; ++k) {
      u[k] = -u[k] - factor * Ft_[k];
      undamped[k] += e * u[k];
    }
    if (!all_finite(N_, u)) return false;
    solver_.solve(u);
  }
  return true;
}

/// Computes the new point and the coefficients of the dense output.
void RosenbrockStepper::end_step(double dt) {
  const auto size = static_cast<std::size_t>(N_), rows = static_cast<std::size_t>(method_->dense().rows());
  next_.t = here_.t + dt;
  std::copy_n(y_.begin(), size, last_.dense.begin());
  if (code_) {
    std::copy_n(end_.y, n(), next_.x.data());
    std::copy_n(end_.y + n(), m(), next_.z.data());
    std::copy_n(end_.xdot, n(), next_.xdot.data());
    std::copy_n(end_.dense, rows * size, std::copy_n(end_.y, size, last_.dense.begin() + N_));
    return;
  }
  std::copy_n(next_.x.data(), n(), last_.dense.data() + size);
  std::copy_n(next_.z.data(), m(), last_.dense.data() + size + n());
  double* const slope = next_.xdot.data();
  for (int k = 0; k < n(); ++k) slope[k] = next_.x[k] - y_[k];
  for (std::size_t r = 0; r < rows; ++r) {
    double* const sum = last_.dense.data() + size * (2 + r);
    combine(N_, nullptr, sums_.dense[r], U_.data(), static_cast<std::ptrdiff_t>(size), sum);
    for (int k = 0; k < n(); ++k) slope[k] -= sum[k];
  }
  for (int k = 0; k < n(); ++k) slope[k] /= dt;
}

/// Completes the new point by projection and x′; false if it is not finite or cannot be reached.
bool RosenbrockStepper::complete(double dt) {
  end_step(dt);
  if (!next_.x.allFinite() || !next_.z.allFinite()) return false;
  const std::optional<bool> moved = project(next_);
  if (!moved) return false;
  if (code_ && !*moved) return next_.xdot.allFinite();
  if (!problem_->is_ode()) return true;
  return rhs_(next_.t, next_.x.data(), next_.xdot.data(), next_.z.data());
}

void RosenbrockStepper::step(double end) {
  constexpr double safety = PredictiveController::safety, smallest = 1.0 / 6, largest = 5, surprising = 3;
  if (!code_) use_code();  // other pivots may suit where the previous ones did not
  begin_step();
  if (!time_derivative(here_)) code_ = nullptr;
  const int order = std::min(method_->order(), method_->embedded_order()) + 1;
  for (int failures = 0;; ++failures) {
    poll_interrupt();
    if (failures == suspicious_failures && settle_again(rhs_)) {
      begin_step();
      if (!time_derivative(here_)) code_ = nullptr;
    }
    const double dt = fitted(dt_, end);
    if ((dt != end - here_.t || control_.repeated) && !is_visible(dt))
      throw vanished(Eigen::Map<const Vec>(scaled_.data(), trouble_.empty() ? N_ : 0), trouble_);
    trouble_.clear();
    const double error = attempt(dt);
    if (!(error <= 1) || !complete(dt)) {
      ++stats_.rejected;
      dt_ = error > 1 && std::isfinite(error) ? dt / std::min(1 / smallest, root(error, order) / safety)
                                              : dt / 4;
      control_.repeated = true;
      continue;
    }
    set_weights();
    const double missed = missed_on_the_way(dt);
    if (const double more = std::max(missed, error_at_end(dt)); more > surprising || missed > 1) {
      ++stats_.rejected;
      dt_ = dt / std::clamp(root(more, order) / safety, 2.0, 1 / smallest);
      control_.repeated = true;
      continue;
    }
    const double quotient = control_.quotient(dt, error, order, safety, 1 / largest, 1 / smallest);
    const double proposed = control_.propose(dt, quotient);
    control_.accept(dt, error);
    pulses_.accept();
    dt_ = dt < as_planned * dt_ ? std::max(proposed, dt_) : proposed;
    if (dt == end - here_.t) next_.t = end;
    last_.t = here_.t;
    last_.dt = dt;
    std::swap(before_, here_);
    std::swap(here_, next_);
    if (entries_at_ == here_.t) entries_.swap(at_end_.entries);
    ++stats_.steps;
    stats_.errors += error;
    return;
  }
}

void RosenbrockStepper::record(double* to) const {
  *to++ = last_.t;
  *to++ = last_.dt;
  std::copy(last_.dense.begin(), last_.dense.end(), to);
}

/// Evaluates inside a step by a step of the method itself from its beginning to t, if that is cheap.
bool RosenbrockStepper::refine(const StepView& step, double t, Point& out) {
  if (!code_ || !time_derivative(step.from)) return false;
  const CompiledRosenbrockStep::End end = code_->run(*problem_, step.from, t - step.from.t, Ft_.data());
  out.t = t;
  out.x = Eigen::Map<const Vec>(end.y, n());
  out.z = Eigen::Map<const Vec>(end.y + n(), m());
  out.xdot = Eigen::Map<const Vec>(end.xdot, n());
  error_inside_ = ErrorSum::norm(end.sum, end.largest, N_);
  return end.regular && out.x.allFinite() && out.z.allFinite() && out.xdot.allFinite();
}

Detail RosenbrockStepper::look(const StepView& step, double t, Detail detail, Point& out) {
  if (t >= step.to.t) {
    out = step.to;
    return Detail::full;
  }
  error_inside_ = 0;
  const bool refined = detail != Detail::coarse && t > step.from.t && refine(step, t, out);
  if (!refined) {
    const double t0 = step.record[0], dt = step.record[1];
    const double* y = step.record + 2;
    std::vector<double> value(static_cast<std::size_t>(N_));
    out.t = t;
    out.xdot.resize(n());
    curve(y, (t - t0) / dt, dt, value.data(), out.xdot.data());
    out.x = Eigen::Map<const Vec>(value.data(), n());
    out.z = Eigen::Map<const Vec>(value.data() + n(), m());
  }
  if (refined && problem_->is_ode()) return Detail::full;
  // a condition of x′ or z is to be the same behind its event, where they are solved for
  if (detail == Detail::full) rhs_(t, out.x.data(), out.xdot.data(), out.z.data());
  return detail;
}

}  // namespace pendula::integrate
