#include "integrate/step/explicit_stepper.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "base/lru_cache.hpp"
#include "base/text.hpp"
#include "integrate/solve/error_sizes.hpp"
#include "integrate/solve/stage_sums.hpp"

namespace pendula::integrate {

ExplicitStepper::ExplicitStepper(ProblemPtr problem, TableauPtr tableau, Tolerances tolerances,
                                 StepLimits limits, Stats& stats)
    : Stepper(std::move(problem), std::move(tolerances), limits, stats),
      tableau_(std::move(tableau)),
      scheme_(scheme_of(tableau_)),
      controller_(scheme_->rules, n()),
      rhs_(problem_, stats),
      rows_(scheme_->rows),
      inverse_atol_(tolerances_.atol.head(n()).cwiseInverse()),
      stage_accuracy_(n() > 0 ? 1e-4 * tolerances_.rtol.head(n()).minCoeff() : 0) {
  const int stages = tableau_->stages();
  code_ = CompiledExplicitStep::make(*problem_, *tableau_, controller_.rules().stiff_stage, tolerances_);
  stages_.K.resize(static_cast<std::size_t>((stages + 3) * n()));
  stages_.Z.resize(static_cast<std::size_t>(stages * m()));
  largest_z_.setZero(m());
  stages_.inverse_weight.resize(static_cast<std::size_t>(n()));
  scaled_.resize(static_cast<std::size_t>(n()));
  for (Point* p : {&next_, &before_}) {
    p->x.resize(n());
    p->xdot.resize(n());
    p->z.resize(m());
  }
}

void ExplicitStepper::check(const Tableau& rk) {
  if (!rk.is_explicit()) throw Error(text("the method ", rk.name(), " is not explicit"));
  if (!rk.bhat())
    throw Error(text("the method ", rk.name(),
                     " has no embedded method to estimate its error: give dt = 0.01 "
                     "for fixed steps, or choose \"dopri5\", \"tsit5\", \"dop853\", \"radau\" or \"bdf\""));
}

std::shared_ptr<const ExplicitStepper::Scheme> ExplicitStepper::scheme_of(const TableauPtr& rk) {
  constexpr std::size_t methods = 16;
  static LruCache<TableauPtr, std::shared_ptr<const Scheme>, std::hash<TableauPtr>, Refers::by_touch> known(
      methods);
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (const auto* found = known.find(rk)) return *found;
  check(*rk);
  const StepRules rules(*rk);
  return known.insert(rk, std::make_shared<const Scheme>(Scheme{rules, rows_of(*rk, rules.stiff_stage)}));
}

/// Extrapolation to stage i by a parabola through the stages nearest in time, or by a lower degree if their
/// times are too close to each other.
StageRow ExplicitStepper::prediction(const Tableau& rk, int i) {
  const auto& c = rk.c();
  constexpr std::size_t points = 3;
  constexpr double apart = 0.01, most = 10;  // limit of Σ|factor|: beyond it, errors of the values dominate
  std::vector<int> order;
  for (int j = i - 1; j >= 0; --j) order.push_back(j);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return std::fabs(c[a] - c[i]) < std::fabs(c[b] - c[i]); });
  StageRow row{{order[0], 1}};
  std::vector<int> nodes{order[0]};
  for (const int j : order) {
    if (nodes.size() == points) break;
    if (std::any_of(nodes.begin(), nodes.end(), [&](int k) { return std::fabs(c[j] - c[k]) < apart; }))
      continue;
    nodes.push_back(j);
    StageRow next;
    double sum = 0;
    for (const int k : nodes) {
      double factor = 1;
      for (const int l : nodes)
        if (l != k) factor *= (c[i] - c[l]) / (c[k] - c[l]);
      next.push_back({k, factor});
      sum += std::fabs(factor);
    }
    if (sum <= most) row = next;
  }
  return row;
}

ExplicitStepper::Rows ExplicitStepper::rows_of(const Tableau& rk, std::optional<int> stiff_stage) {
  const int stages = rk.stages();
  const auto without_zeros = [stages](const auto& factor) {
    StageRow row;
    for (int j = 0; j < stages; ++j)
      if (factor(j) != 0) row.push_back({j, factor(j)});
    return row;
  };
  Rows rows;
  for (int i = 0; i < stages; ++i) {
    rows.A.push_back(without_zeros([&](int j) { return j < i ? rk.A()(i, j) : 0; }));
    rows.prediction.push_back(i > 0 ? prediction(rk, i) : StageRow{});
    rows.c.push_back(rk.c()[i]);
  }
  rows.b = without_zeros([&](int j) { return rk.b()[j]; });
  rows.error = without_zeros([&](int j) { return rk.b()[j] - (*rk.compared())[j]; });
  if (rk.bhat2()) rows.second_error = without_zeros([&](int j) { return rk.b()[j] - (*rk.bhat2())[j]; });
  if (stiff_stage) rows.stiff = without_zeros([&](int j) { return rk.b()[j] - rk.A()(*stiff_stage, j); });
  return rows;
}

void ExplicitStepper::start(const Point& point, double end) {
  here_ = point;
  largest_z_.setZero();
  rhs_.require(here_.t, here_.x.data(), here_.xdot.data(), here_.z.data());
  control_ = controller_.start(limits_.dt_first > 0 ? limits_.dt_first : first_step(end));
  last_error_ = 0;
  size_ = size_of(here_.x);
  dt_ = control_.dt;
}

/// Hairer, Nørsett & Wanner I, §II.4, "Starting Step Size".
double ExplicitStepper::first_step(double end) {
  const double longest = std::min(end - here_.t, limits_.dt_max);
  const auto norm = [&](const Vec& v) {
    ErrorSum sum;
    for (int i = 0; i < n(); ++i) sum.add(v[i] / weight(i, std::fabs(here_.x[i])));
    return sum.norm(n());
  };
  const double cautious = cautious_step(end);
  const Vec ahead = here_.x + cautious * here_.xdot;
  Vec slope = here_.xdot;
  next_.z = here_.z;
  if (!rhs_(here_.t + cautious, ahead.data(), slope.data(), next_.z.data())) return cautious * 1e-3;
  const double steepest = std::max(norm(here_.xdot), norm(slope - here_.xdot) / cautious);
  return integrate::first_step(cautious, steepest, here_.t, longest, controller_.rules().control_order);
}

/// Computes a step, compiled or stage by stage: all Kᵢ (and zᵢ), the state at its end and the error
/// estimates. False if something cannot be evaluated.
bool ExplicitStepper::compute(const Point& from, double dt) {
  const int size = n(), zs = m(), stages = tableau_->stages();
  const bool ode = problem_->is_ode();
  coded_ = false;
  if (code_) {
    end_ = code_->run(*problem_, from, dt);
    double sum = 0;
    for (int k = 0; k < 2 * size; ++k) sum += end_.x[k] * 0;  // x and x′
    stats_.evaluations += controller_.rules().fsal ? stages - 1 : stages;
    coded_ = sum == 0;  // otherwise the loop below finds the equation that is not finite
    if (coded_) {
      code_failures_ = 0;
      return true;
    }
  }
  double *const K = stages_.K.data(), *const Z = stages_.Z.data();
  std::copy_n(from.xdot.data(), size, K);
  std::copy_n(from.z.data(), zs, Z);
  double* at = problem_->unknowns();
  for (int i = 1; i < stages; ++i) {
    double* Ki = K + static_cast<std::ptrdiff_t>(i) * size;
    double* Zi = Z + static_cast<std::ptrdiff_t>(i) * zs;
    if (!ode) {
      predict(i, size, K);
      predict(i, zs, Z);
    }
    add_stages(size, from.x.data(), dt, rows_.A[i], K, at);
    const bool mesh_point = i + 1 == stages && controller_.rules().fsal;
    if (!rhs_.stage(from.t + rows_.c[i] * dt, at, Ki, Zi, mesh_point ? 0 : stage_accuracy_)) {
      trouble_ = rhs_.reason();
      return false;
    }
  }
  add_stages(size, from.x.data(), dt, rows_.b, K, behind_stages(0));
  std::fill_n(behind_stages(1), 2 * size, 0.0);
  add_stages(size, behind_stages(1), dt, rows_.error, K, behind_stages(1));
  add_stages(size, behind_stages(2), dt, rows_.second_error, K, behind_stages(2));
  // failures in succession; the linear system always needs pivoting, and each step would be computed twice
  constexpr int patience = 5;
  if (code_ && ++code_failures_ == patience) code_.reset();
  return true;
}

/// Predicts the values of stage i from those of the stages so far.
void ExplicitStepper::predict(int i, int size, double* values) const {
  double* to = values + static_cast<std::ptrdiff_t>(i) * size;
  std::fill_n(to, size, 0.0);
  for (const StageTerm& term : rows_.prediction[i]) {
    const double* from = values + static_cast<std::ptrdiff_t>(term.stage) * size;
    for (int k = 0; k < size; ++k) to[k] += term.factor * from[k];
  }
}

double ExplicitStepper::error_norm() {
  const int size = n();
  const auto combined = [this](double fifth, double third) {
    return rows_.second_error.empty() ? fifth : combined_error(fifth, third);
  };
  if (coded_) {
    std::copy_n(end_.scaled, size, scaled_.data());
    // multiplied by the reciprocal, like the lane code for a division by a constant
    const double share = 1.0 / std::max(size, 1);
    return combined(ErrorSum::norm(end_.sum * share, end_.largest, 1),
                    ErrorSum::norm(end_.second_sum * share, end_.second_largest, 1));
  }
  const ErrorSizes sizes =
      error_sizes(size, here_.x.data(), next_.x.data(), tolerances_.atol.data(), tolerances_.rtol.data(),
                  behind_stages(1), behind_stages(2), stages_.inverse_weight.data(), scaled_.data());
  return std::max(combined(ErrorSum::norm(sizes.first.sum, sizes.first.largest, size),
                           ErrorSum::norm(sizes.second.sum, sizes.second.largest, size)),
                  unresolved());
}

/// Do the stages resolve a z in which the equations are nonlinear? Judged by the error estimate of ∫z dt
/// relative to the square root of the tolerances, and by the change of z relative to its largest value so
/// far. z does not act back on x, but if it oscillates between two stages, whatever it switches on may lie
/// between them, such as the current pulse that charges a capacitor behind a rectifier.
double ExplicitStepper::unresolved() {
  if (m() == 0 || rhs_.is_linear()) return 0;
  constexpr double most = 0.5;  // of the largest z: a sine is sampled at least six times per period
  double largest = 0;
  for (int k = 0; k < m(); ++k) {
    const auto z = [&](int stage) { return stages_.Z.data()[stage * m() + k]; };
    double error = 0, least = here_.z[k], greatest = here_.z[k];
    for (const StageTerm& term : rows_.error) error += term.factor * z(term.stage);
    for (int i = 0; i < tableau_->stages(); ++i) {
      least = std::min(least, z(i));
      greatest = std::max(greatest, z(i));
    }
    const double known = largest_z_[k], rtol = tolerances_.rtol[n() + k];
    const double w = weight(n() + k, std::max({known, -least, greatest}));
    largest = std::max(largest, std::fabs(error) * std::sqrt(rtol) / w);
    if (known > 0) largest = std::max(largest, (greatest - least) * rtol / (most * w));
    if (largest <= 1) largest_z_[k] = std::max({known, -least, greatest});
  }
  return largest;
}

ExplicitStepper::Attempt ExplicitStepper::attempt(double dt) {
  if (!compute(here_, dt)) return Attempt::not_finite;
  std::copy_n(end_of_step(), n(), next_.x.data());
  error_now_ = error_norm();
  if (!(error_now_ <= std::numeric_limits<double>::max())) return Attempt::not_finite;
  if (error_now_ > 1) return Attempt::rejected;
  next_.t = here_.t + dt;
  if (!complete()) return Attempt::not_finite;
  if (!controller_.watches_stiffness()) return Attempt::accepted;
  signs_ = signs(dt);
  if (controller_.resolves(dt, signs_)) return Attempt::accepted;
  error_now_ = Controller::unresolved;
  return Attempt::rejected;
}

/// Projects the new point and computes x′ and z there.
bool ExplicitStepper::complete() {
  const std::optional<bool> moved = coded_ && end_.near_conditions ? false : project(next_);
  if (!moved) return false;
  take_slope(next_);
  if ((coded_ || controller_.rules().fsal) && !*moved) return true;
  if (rhs_(next_.t, next_.x.data(), next_.xdot.data(), next_.z.data())) return true;
  trouble_ = rhs_.reason();
  return false;
}

/// The stiffness signs of a completed step.
StepSigns<double> ExplicitStepper::signs(double dt) {
  StepSigns<double> signs;
  const ChangeSizes sizes = change_sizes(n(), next_.xdot.data(), here_.xdot.data(), next_.x.data(),
                                         tolerances_.atol.data(), tolerances_.rtol.data());
  signs.change = sizes.change;
  signs.size = sizes.size;
  if (coded_) {
    signs.slopes = end_.slope_change;
    signs.points = end_.change;
    return signs;
  }
  const int size = n();
  double* difference = behind_stages(1);  // (x₁ - g)/h; the error estimate is no longer needed
  std::fill_n(difference, size, 0.0);
  add_stages(size, difference, 1, rows_.stiff, stages_.K.data(), difference);
  const double* K = stages_.K.data() + static_cast<std::ptrdiff_t>(*controller_.rules().stiff_stage) * size;
  for (int k = 0; k < size; ++k) {
    const double w = stages_.inverse_weight[k];
    const double f = (next_.xdot[k] - K[k]) * w, d = dt * difference[k] * w;
    signs.slopes += f * f;
    signs.points += d * d;
  }
  return signs;
}

void ExplicitStepper::step(double end) {
  for (;;) {
    const double dt = fitted(control_.dt, end);
    if ((dt != end - here_.t || control_.repeated > 0) && !is_visible(dt))
      throw vanished(Eigen::Map<const Vec>(scaled_.data(), trouble_.empty() ? n() : 0), trouble_);
    trouble_.clear();
    const Attempt outcome = attempt(dt);
    if (outcome != Attempt::not_finite && is_last_step_doubtful(dt)) {
      doubtful_steps_.push_back({before_.t, last_error_});
      last_error_ = 0;
    }
    if (outcome != Attempt::accepted) {
      ++stats_.rejected;
      control_ = outcome == Attempt::rejected ? controller_.reject(control_, dt, error_now_)
                                              : controller_.undefined(control_, dt);
      continue;
    }
    control_ = controller_.accept(control_, dt, error_now_);
    stats_.errors += error_now_;
    last_error_ = error_now_;
    if (controller_.watches_stiffness()) control_ = controller_.watch(control_, dt, signs_);
    dt_ = control_.dt;
    if (end - next_.t <= 0 || dt == end - here_.t) next_.t = end;
    std::swap(before_, here_);
    std::swap(here_, next_);
    ++stats_.steps;
    size_before_ = std::exchange(size_, size_of(here_.x));
    return;
  }
}

/// After an attempt of length dt, whose error is error_now_: may the error of the step before be so much
/// larger than its estimate that the run should say so? docs/derivations.md#step-size-control
///
/// In hindsight: by the coefficient of the new estimate, E (h₀/h)ᵏ. By growth: of x′ = λx, dop853 errs by
/// three tolerances where the solution grows tenfold in a step and by seven where it grows thirtyfold, and
/// estimates 0.4 and 0.9; tsit5 by one at 4.7, and estimates 0.5.
///
/// The steps of a short run of a small model all are: to judge them takes milliseconds. That finds waves
/// which stages and steps pass alike (b′ = b/(sin(e^t b)² + 1)).
bool ExplicitStepper::is_last_step_doubtful(double dt) const {
  constexpr double growth = 4, share = 0.2;
  if (n() == 0 || last_error_ == 0 || stats_.errors > Stats::many_errors) return false;
  if (stats_.steps * n() <= few_values) return true;
  const double length = here_.t - before_.t;
  if (error_now_ < Controller::unresolved && (error_now_ > 1 || dt < length)) {
    const double hindsight = error_now_ * std::pow(length / dt, controller_.rules().control_order);
    // a root mean square of few components hides the largest one
    if (std::sqrt(std::min(n(), 9)) * hindsight > share * Stats::many_errors) return true;
  }
  return size_ > growth * size_before_ && size_before_ > 1 / tolerances_.rtol.head(n()).minCoeff();
}

/// The largest component of x in units of atol; 0 while all steps are doubtful.
double ExplicitStepper::size_of(const Vec& x) const {
  if (n() == 0 || stats_.steps * n() < few_values) return 0;
  return x.cwiseAbs().cwiseProduct(inverse_atol_).maxCoeff();
}

double ExplicitStepper::error_by_doubling(const StepView& step) {
  const double half = (step.to.t - step.from.t) / 2;
  Point middle = step.from;
  const auto go_half = [&](const Point& from) {
    if (!compute(from, half)) return false;
    std::copy_n(end_of_step(), n(), middle.x.data());
    return true;
  };
  middle.t += half;
  if (!go_half(step.from) || !rhs_(middle.t, middle.x.data(), middle.xdot.data(), middle.z.data()) ||
      !go_half(Point(middle)))
    return 0;
  double largest = 0;
  for (int i = 0; i < n(); ++i) {
    const double size = std::max(std::fabs(step.from.x[i]), std::fabs(step.to.x[i]));
    largest = std::max(largest, std::fabs(middle.x[i] - step.to.x[i]) / weight(i, size));
  }
  return largest;
}

Detail ExplicitStepper::look(const StepView& step, double t, Detail detail, Point& out) {
  const double dt = t - step.from.t;
  if (t >= step.to.t || dt <= 0) {
    out = t >= step.to.t ? step.to : step.from;
    return Detail::full;
  }
  out.t = t;
  const bool computed = detail != Detail::coarse && compute(step.from, dt);
  error_inside_ = computed ? error_norm() : 0;
  if (computed) {
    out.x.resize(n());
    std::copy_n(end_of_step(), n(), out.x.data());
  } else {
    hermite(step, t, out);
    if (detail == Detail::coarse) return detail;
  }
  constexpr double visible = 1e-3;  // of a tolerance: a hundredth of Problem::projection_share
  const bool moved = problem_->projects() &&
                     problem_->project_if_needed(t, out.x, tolerances_.rtol, tolerances_.atol, visible);
  const bool has_slope = computed && (coded_ || controller_.rules().fsal);
  if (has_slope || detail == Detail::full) {
    out.xdot = step.to.xdot;  // where stages fail, interpolation between the ends cannot give z
    out.z = step.to.z;
  }
  if (has_slope || (computed && detail == Detail::full)) take_slope(out);
  if (has_slope && !moved) return Detail::full;
  if (detail == Detail::full) rhs_.require(t, out.x.data(), out.xdot.data(), out.z.data());
  return detail;
}

/// x′ and z of the last stage, which may lie near the end of the step only.
void ExplicitStepper::take_slope(Point& out) {
  if (coded_) {
    std::copy_n(end_.xdot, n(), out.xdot.data());
    return;
  }
  const auto last = static_cast<std::ptrdiff_t>(tableau_->stages() - 1);
  std::copy_n(stages_.K.data() + last * n(), n(), out.xdot.data());
  std::copy_n(stages_.Z.data() + last * m(), m(), out.z.data());
}

}  // namespace pendula::integrate
