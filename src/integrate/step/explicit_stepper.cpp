#include "integrate/step/explicit_stepper.hpp"

#include <algorithm>
#include <cmath>

#include "base/four.hpp"
#include "base/text.hpp"

namespace pendula::integrate {
namespace {

const float smallest_log_error = std::log(1e-4f);

/// out[k] = x[k] + h Σ aⱼ Kⱼ[k], sixteen components at a time so that the sums stay in registers.
template <class Row>
[[gnu::always_inline]] inline void combined(int n, const double* x, double h, const Row& row, const double* K,
                                            double* out) {
  constexpr int wide = 16, parts = 4;
  int k = 0;
  for (; k + wide <= n; k += wide) {
    Four sum[parts] = {};
    Four part;
    for (const auto& term : row) {
      const double* Kj = K + static_cast<std::ptrdiff_t>(term.stage) * n + k;
#pragma GCC unroll 4
      for (int l = 0; l < parts; ++l) {
        load(part, Kj + 4 * l);
        sum[l] += term.factor * part;
      }
    }
#pragma GCC unroll 4
    for (int l = 0; l < parts; ++l) {
      load(part, x + k + 4 * l);
      store(out + k + 4 * l, part + h * sum[l]);
    }
  }
  for (; k < n; ++k) {
    double sum = 0;
    for (const auto& term : row) sum += term.factor * K[static_cast<std::ptrdiff_t>(term.stage) * n + k];
    out[k] = x[k] + h * sum;
  }
}

#if defined(__x86_64__) && defined(__GNUC__)
template <class Row>
[[gnu::target("avx2")]] void combine_avx2(int n, const double* x, double h, const Row& row, const double* K,
                                          double* out) {
  combined(n, x, h, row, K, out);
}
const bool has_avx2 = __builtin_cpu_supports("avx2");
#endif

template <class Row>
void combine(int n, const double* x, double h, const Row& row, const double* K, double* out) {
#if defined(__x86_64__) && defined(__GNUC__)
  constexpr int large = 64;
  if (n >= large && has_avx2) return combine_avx2(n, x, h, row, K, out);
#endif
  combined(n, x, h, row, K, out);
}

}  // namespace

ExplicitStepper::ExplicitStepper(ProblemPtr problem, TableauPtr tableau, Tolerances tolerances,
                                 StepLimits limits, Stats& stats)
    : Stepper(std::move(problem), std::move(tolerances), limits, stats),
      tableau_(std::move(tableau)),
      rules_(checked(*tableau_)),
      derivative_(problem_, stats),
      stages_(tableau_->stages()) {
  prepare();
}

const Tableau& ExplicitStepper::checked(const Tableau& rk) {
  if (!rk.is_explicit()) throw Error(text("the method ", rk.name(), " is not explicit"));
  if (!rk.bhat())
    throw Error(text("the method ", rk.name(),
                     " has no embedded method to estimate its error: give dt = 0.01 "
                     "for fixed steps, or choose \"dopri5\", \"tsit5\", \"dop853\", \"radau\" or \"bdf\""));
  return rk;
}

void ExplicitStepper::prepare() {
  const Tableau& rk = *tableau_;
  for (int i = 0; i < stages_; ++i) {
    rows_.emplace_back();
    for (int j = 0; j < i; ++j)
      if (rk.A()(i, j) != 0) rows_.back().push_back({j, rk.A()(i, j)});
    c_.push_back(rk.c()[i]);
    if (rk.b()[i] != 0) weights_.push_back({i, rk.b()[i]});
    if (rk.b()[i] != (*rk.bhat())[i]) error_.push_back({i, rk.b()[i] - (*rk.bhat())[i]});
  }
  if (const int g = rules_.stiff_stage; g >= 0)
    for (int j = 0; j < stages_; ++j)
      if (rk.A()(g, j) != rk.b()[j]) stiff_row_.push_back({j, rk.b()[j] - rk.A()(g, j)});
  if (rk.bhat2())
    for (int i = 0; i < stages_; ++i)
      if (const double e = rk.b()[i] - (*rk.bhat2())[i]; e != 0) second_error_.push_back({i, e});
  code_ = ExplicitCode::make(*problem_, rk, rules_.stiff_stage, tolerances_);
  K_.resize(static_cast<std::size_t>((stages_ + 3) * n()));
  Z_.resize(static_cast<std::size_t>(stages_ * m()));
  scaled_.resize(static_cast<std::size_t>(n()));
  inverse_weight_.resize(static_cast<std::size_t>(n()));
  x_.resize(n()), trial_.resize(n());
  for (Point* p : {&next_, &before_}) p->x.resize(n()), p->xdot.resize(n()), p->z.resize(m());
}

void ExplicitStepper::start(const Point& point, double end) {
  here_ = point;
  derivative_.require(here_.t, here_.x.data(), here_.xdot.data(), here_.z.data());
  log_error_old_ = smallest_log_error;
  rejected_ = false;
  stiff_hits_ = calm_ = alike_ = 0;
  rejected_dt_ = longest_since_ = 0, accepted_since_ = 0;
  since_start_ = 0;
  ceiling_ = std::numeric_limits<double>::infinity();
  dt_ = limits_.dt_first > 0 ? limits_.dt_first : first_step(end);
}

/// Hairer, Nørsett & Wanner I, §II.4, "Starting Step Size".
double ExplicitStepper::first_step(double end) {
  const double longest = std::min(end - here_.t, limits_.dt_max);
  const auto norm = [&](const Vec& v) {
    ErrorSum sum;
    for (int i = 0; i < n(); ++i) sum.add(v[i] / weight(i, std::fabs(here_.x[i])));
    return sum.norm(n());
  };
  const double h0 = cautious_step(end);
  trial_ = here_.x + h0 * here_.xdot;
  x_ = here_.xdot;
  next_.z = here_.z;
  if (!derivative_(here_.t + h0, trial_.data(), x_.data(), next_.z.data())) return h0 * 1e-3;
  const double d2 = norm(x_ - here_.xdot) / h0;
  const double steepest = std::max(norm(here_.xdot), d2);
  const double h1 = steepest <= 1e-15 ? std::max(1e-6 * longest, h0 * 1e-3)
                                      : std::pow(0.01 / steepest, 1.0 / rules_.control_order);
  return visible(std::min(100 * h0, h1), longest);
}

/// The step as code, or all Kᵢ (and zᵢ), the state at its end and the error estimates; false if one cannot
/// be evaluated.
bool ExplicitStepper::stages(const Point& from, double dt) {
  const int size = n(), zs = m();
  const bool ode = problem_->is_ode();
  coded_ = false;
  if (code_) {
    end_ = code_->run(*problem_, from, dt);
    double sum = 0;
    for (int k = 0; k < 2 * size; ++k) sum += end_.x[k] * 0;  // x and x′
    stats_.evaluations += fsal() ? stages_ - 1 : stages_;
    coded_ = sum == 0;  // else the loop below says which equation is not finite
    if (coded_) return true;
  }
  std::copy_n(from.xdot.data(), size, K_.data());
  std::copy_n(from.z.data(), zs, Z_.data());
  double* at = problem_->unknowns();
  for (int i = 1; i < stages_; ++i) {
    double* Ki = K_.data() + static_cast<std::ptrdiff_t>(i) * size;
    double* Zi = Z_.data() + static_cast<std::ptrdiff_t>(i) * zs;
    const auto row = static_cast<std::size_t>(i);
    if (!ode) {
      std::copy_n(Ki - size, size, Ki);
      std::copy_n(Zi - zs, zs, Zi);
    }
    combine(size, from.x.data(), dt, rows_[row], K_.data(), at);
    if (!derivative_(from.t + c_[row] * dt, at, Ki, Zi)) {
      trouble_ = derivative_.reason();
      return false;
    }
  }
  const double* x = from.x.data();
  combine(size, x, dt, weights_, K_.data(), behind_stages(0));
  std::fill_n(behind_stages(1), 2 * size, 0.0);
  combine(size, behind_stages(1), dt, error_, K_.data(), behind_stages(1));
  combine(size, behind_stages(2), dt, second_error_, K_.data(), behind_stages(2));
  return true;
}

double ExplicitStepper::error_norm() {
  const int size = n();
  if (coded_) {
    std::copy_n(end_.scaled, size, scaled_.data());
    return combined_norm(ErrorSum::norm(end_.sum, end_.largest, size),
                         ErrorSum::norm(end_.second_sum, end_.second_largest, size));
  }
  ErrorSum sum, second;
  const double *e = behind_stages(1), *other = behind_stages(2);
  for (int k = 0; k < size; ++k) {
    const double before = std::fabs(here_.x[k]), after = std::fabs(next_.x[k]);
    const double w = inverse_weight_[k] = 1 / weight(k, std::max(before, after));
    scaled_[k] = e[k] * w;
    sum.add(scaled_[k]);
    second.add(other[k] * w);
  }
  return combined_norm(sum.norm(size), second.norm(size));
}

/// DOP853: orders 5 and 3 combined to one of 8.
double ExplicitStepper::combined_norm(double first, double third) const {
  if (second_error_.empty() || first == 0) return first;
  return first * first / std::sqrt(first * first + 0.01 * third * third);
}

ExplicitStepper::Attempt ExplicitStepper::attempt(double dt) {
  if (!stages(here_, dt)) return Attempt::not_finite;
  std::copy_n(end_of_step(), n(), next_.x.data());
  error_now_ = error_norm();
  if (!(error_now_ <= std::numeric_limits<double>::max())) return Attempt::not_finite;
  if (error_now_ > 1) return Attempt::rejected;
  next_.t = here_.t + dt;
  return complete() ? Attempt::accepted : Attempt::not_finite;
}

/// Projection, x′ and z at the new point.
bool ExplicitStepper::complete() {
  bool moved = false;
  if (problem_->projects() && !(coded_ && end_.near_conditions)) {
    try {
      moved = problem_->project_if_needed(next_.t, next_.x, tolerances_.rtol, tolerances_.atol,
                                          ExplicitCode::share);
    } catch (const Failure& failure) {
      trouble_ = failure.what();
      return false;
    }
  }
  if (coded_) {
    std::copy_n(end_.xdot, n(), next_.xdot.data());
    if (!moved) return true;
  } else {
    std::copy_n(K_.data() + static_cast<std::ptrdiff_t>(stages_ - 1) * n(), n(), next_.xdot.data());
    std::copy_n(Z_.data() + static_cast<std::ptrdiff_t>(stages_ - 1) * m(), m(), next_.z.data());
    if (fsal() && !moved) return true;
  }
  if (derivative_(next_.t, next_.x.data(), next_.xdot.data(), next_.z.data())) return true;
  trouble_ = derivative_.reason();
  return false;
}

/// x′ hardly changes in a step: one that accuracy asks for turns it by some tenths. Near the edge of the
/// stability region error estimates see the fast parts that the solution does not have, and at tight
/// tolerances settle well inside it.
bool ExplicitStepper::is_smooth() const {
  constexpr double hardly = 0.02;
  double change = 0, size = 0;
  for (int k = 0; k < n(); ++k) {
    const double w = 1 / weight(k, std::fabs(next_.x[k]));
    const double d = (next_.xdot[k] - here_.xdot[k]) * w, s = next_.xdot[k] * w;
    change += d * d, size += s * s;
  }
  return change <= hardly * hardly * size;
}

/// ‖f(x₁) - f(g)‖ / ‖x₁ - g‖ estimates the largest eigenvalue; near the edge of the stability region again
/// and again means stiff.
void ExplicitStepper::watch_stiffness(double dt) {
  if (rules_.stiff_stage < 0 || ++since_start_ < 10 || is_stiff()) return;
  double numerator = 0, denominator = 0;
  if (coded_) {
    numerator = end_.slope_change * (dt * dt), denominator = end_.change;
  } else {
    const int size = n();
    double* difference = behind_stages(1);  // (x₁ - g)/h; the error estimate is not needed any more
    std::fill_n(difference, size, 0.0);
    combine(size, difference, 1, stiff_row_, K_.data(), difference);
    const double* K = K_.data() + static_cast<std::ptrdiff_t>(rules_.stiff_stage) * size;
    for (int k = 0; k < size; ++k) {
      const double w = inverse_weight_[k];
      const double f = (next_.xdot[k] - K[k]) * w, d = difference[k] * w;
      numerator += f * f, denominator += d * d;
    }
  }
  if (!(denominator > 0)) return;
  const double h_lambda = std::sqrt(numerator / denominator);
  const bool limited = h_lambda > 0.95 * rules_.stability_limit;
  if (limited || (h_lambda > 0.3 * rules_.stability_limit && is_smooth())) {
    calm_ = 0, ++stiff_hits_;
  } else if (stiff_hits_ > 0 && ++calm_ >= 6) {
    calm_ = stiff_hits_ = 0;
  }
}

/// Where stability limits the steps, the error estimate says so only after the step was too long: the step
/// size would run into the limit every few steps. Once that has been seen it stays a little below, and tries
/// again later.
void ExplicitStepper::remember_rejection(double dt) {
  constexpr int again = 12;             // accepted steps between two rejections
  constexpr int many = 8, large = 200;  // small models: accuracy does the same, and costs nothing
  if (accepted_since_ >= 1) {
    const bool alike =
        accepted_since_ <= again && std::fabs(dt - rejected_dt_) < 0.2 * dt && longest_since_ < 1.2 * dt;
    alike_ = alike ? alike_ + 1 : 0;
  }
  if (is_stiff() || (n() >= large && alike_ >= many)) ceiling_ = 0.95 * dt;
  rejected_dt_ = dt, longest_since_ = 0, accepted_since_ = 0;
}

void ExplicitStepper::adapt(double dt, Attempt outcome) {
  constexpr double safety = 0.9;
  if (outcome == Attempt::not_finite) {
    dt_ = dt * 0.25;
    rejected_ = true;
    return;
  }
  const auto exponent = static_cast<float>(rules_.exponent);  // three digits are plenty for a step size
  const float log_error = std::log(static_cast<float>(error_now_));
  if (outcome == Attempt::rejected) {
    dt_ = dt / std::min(1 / rules_.slowest, std::exp(exponent * log_error) / safety);
    rejected_ = true;
    remember_rejection(dt);
    return;
  }
  double factor = std::exp(exponent * log_error - static_cast<float>(rules_.beta) * log_error_old_);
  factor = std::clamp(factor / safety, 1 / rules_.fastest, 1 / rules_.slowest);
  double proposed = dt / factor;
  if (rejected_) proposed = std::min(proposed, dt);
  log_error_old_ = std::max(log_error, smallest_log_error);
  rejected_ = false;
  ++accepted_since_, longest_since_ = std::max(longest_since_, dt);
  constexpr int soon = 60;
  ceiling_ *= accepted_since_ < soon ? 1.002 : 1.05;
  dt_ = std::min(proposed, ceiling_);
}

void ExplicitStepper::step(double end) {
  for (;;) {
    const double dt = fitted(dt_, end);
    if ((dt != end - here_.t || rejected_) && !is_visible(dt))
      throw vanished(Eigen::Map<const Vec>(scaled_.data(), trouble_.empty() ? n() : 0), trouble_);
    trouble_.clear();
    const Attempt outcome = attempt(dt);
    if (outcome != Attempt::accepted) {
      ++stats_.rejected;
      adapt(dt, outcome);
      continue;
    }
    watch_stiffness(dt);
    const bool shortened = dt < dt_ * 0.99;
    const double planned = dt_;
    adapt(dt, outcome);
    if (shortened) dt_ = std::max(dt_, planned);  // cut for `end`, not for accuracy
    if (end - next_.t <= 0 || dt == end - here_.t) next_.t = end;
    std::swap(before_, here_);
    std::swap(here_, next_);
    ++stats_.steps;
    return;
  }
}

/// Cubic Hermite interpolation between the ends of a step.
void ExplicitStepper::sketch(const StepView& step, double t, Point& out) const {
  const double h = step.to.t - step.from.t, u = (t - step.from.t) / h, v = 1 - u;
  const double a = v * v * (1 + 2 * u), b = u * u * (3 - 2 * u), c = h * u * v * v, d = -h * u * u * v;
  const double da = 6 * u * v / h, dc = v * (1 - 3 * u), dd = u * (3 * u - 2);
  const Point &p = step.from, &q = step.to;
  out.x = a * p.x + b * q.x + c * p.xdot + d * q.xdot;
  out.xdot = da * (q.x - p.x) + dc * p.xdot + dd * q.xdot;
  out.z = v * p.z + u * q.z;
}

void ExplicitStepper::interpolate(const StepView& step, double t, Detail detail, Point& out) {
  const double dt = t - step.from.t;
  if (t >= step.to.t || dt <= 0) {
    out = t >= step.to.t ? step.to : step.from;
    return;
  }
  out.t = t;
  if (detail == Detail::sketch || !stages(step.from, dt)) return sketch(step, t, out);
  out.x.resize(n());
  std::copy_n(end_of_step(), n(), out.x.data());
  if (problem_->projects()) problem_->project_if_needed(t, out.x, tolerances_.rtol, tolerances_.atol, 1e-3);
  if (detail == Detail::state) return;
  out.xdot = step.to.xdot, out.z = step.to.z;
  if (!coded_)
    std::copy_n(Z_.data() + static_cast<std::ptrdiff_t>(stages_ - 1) * m(), m(), out.z.data());  // near t
  derivative_.require(t, out.x.data(), out.xdot.data(), out.z.data());
}

}  // namespace pendula::integrate
