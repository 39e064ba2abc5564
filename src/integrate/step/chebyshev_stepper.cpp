#include "integrate/step/chebyshev_stepper.hpp"

#include <algorithm>
#include <cmath>

#include "base/epsilon.hpp"
#include "base/interrupt.hpp"

namespace pendula::integrate {
namespace {

constexpr int order = 2;

}  // namespace

ChebyshevStepper::ChebyshevStepper(ProblemPtr problem, Tolerances tolerances, StepLimits limits, Stats& stats)
    : Stepper(std::move(problem), std::move(tolerances), limits, stats), rhs_(problem_, stats) {
  for (Vec* v : {&Y_[0], &Y_[1], &Y_[2], &F_, &error_}) v->setZero(n());
}

const Chebyshev& ChebyshevStepper::method(int stages) {
  return methods_.try_emplace(stages, stages).first->second;
}

void ChebyshevStepper::start(const Point& point, double end) {
  here_ = point;
  rhs_.require(here_.t, here_.x.data(), here_.xdot.data(), here_.z.data());
  before_ = next_ = here_;
  control_.start();
  direction_.resize(0);
  measure_spectrum();
  dt_ = limits_.dt_first > 0 ? limits_.dt_first : cautious_step(end);
}

/// The spectral radius of ∂x′/∂x by the power method on differences of x′, slightly enlarged. Starts from the
/// vector of the last call. Numbers of RKC (Sommeijer, Shampine & Verwer, J. Comput. Appl. Math. 88, 1998).
void ChebyshevStepper::measure_spectrum() {
  constexpr int most = 50;
  constexpr double enlarged = 1.2, accurate = 0.01;
  since_spectrum_ = 0;
  if (direction_.size() == 0) {
    direction_ = here_.xdot;
    for (int k = 0; k < n(); ++k) direction_[k] += 1e-3 * (1 + std::cos(1.7 * k)) * (here_.xdot.norm() + 1);
  }
  const double size = here_.x.norm(), step = std::sqrt(eps) * (size > 0 ? size : 1);
  double radius = 0;
  Vec ahead(n()), slope = here_.xdot, z = here_.z;
  for (int k = 0; k < most; ++k) {
    const double length = direction_.norm();
    if (!(length > 0) || !std::isfinite(length)) break;
    ahead = here_.x + step / length * direction_;
    if (!rhs_(here_.t, ahead.data(), slope.data(), z.data())) break;
    direction_ = (slope - here_.xdot) / step;
    const double before = radius;
    radius = direction_.norm();
    if (k > 1 && std::fabs(radius - before) <= accurate * radius) break;
  }
  radius_ = enlarged * radius;
}

/// Computes a step; out: x at its end. False if an equation cannot be evaluated.
bool ChebyshevStepper::compute(const Point& from, double dt, Point& out) {
  const Chebyshev& rk = method(Chebyshev::stages_for(dt * radius_));
  const double* f0 = from.xdot.data();
  const double* x0 = from.x.data();
  double *before = Y_[0].data(), *now = Y_[1].data(), *next = Y_[2].data(), *f = F_.data();
  const int size = n();
  std::copy_n(x0, size, before);
  const double first = dt * rk.stage[1].slope;
  for (int k = 0; k < size; ++k) now[k] = x0[k] + first * f0[k];
  if (out.z.size() != m()) out.z = from.z;
  F_ = from.xdot;
  for (int j = 2; j <= rk.stages; ++j) {
    const Chebyshev::Stage& row = rk.stage.at(static_cast<std::size_t>(j));
    if (!rhs_(from.t + rk.stage.at(static_cast<std::size_t>(j) - 1).c * dt, now, f, out.z.data())) {
      trouble_ = rhs_.reason();
      return false;
    }
    const double rest = 1 - row.mu - row.nu, a = dt * row.slope, b = dt * row.first_slope;
    for (int k = 0; k < size; ++k)
      next[k] = rest * x0[k] + row.mu * now[k] + row.nu * before[k] + a * f[k] + b * f0[k];
    double* const free = before;
    before = now;
    now = next;
    next = free;
  }
  out.x = Eigen::Map<const Vec>(now, size);
  return true;
}

ChebyshevStepper::Attempt ChebyshevStepper::attempt(double dt) {
  next_.t = here_.t + dt;
  if (!compute(here_, dt, next_)) return Attempt::not_finite;
  if (!project(next_)) return Attempt::not_finite;
  next_.xdot = F_;
  if (!rhs_(next_.t, next_.x.data(), next_.xdot.data(), next_.z.data())) {
    trouble_ = rhs_.reason();
    return Attempt::not_finite;
  }
  ErrorSum sum;
  for (int k = 0; k < n(); ++k) {
    // the estimate of RKC, ibid. (1998)
    const double e = 0.8 * (here_.x[k] - next_.x[k]) + 0.4 * dt * (here_.xdot[k] + next_.xdot[k]);
    error_[k] = e / weight(k, std::max(std::fabs(here_.x[k]), std::fabs(next_.x[k])));
    sum.add(error_[k]);
  }
  norm_ = std::max(sum.norm(n()), least_error);
  constexpr double overflow = 1e100;  // its powers are finite
  if (!(norm_ <= overflow)) return Attempt::not_finite;
  return norm_ <= 1 ? Attempt::accepted : Attempt::rejected;
}

void ChebyshevStepper::step(double end) {
  // steps between estimates of the spectrum, which is estimated again after a failed step as well
  constexpr int often = 25, most_stages = 400;  // 25 as in RKC
  constexpr double fastest = 5, slowest = 10;
  if (since_spectrum_ >= often) measure_spectrum();
  for (;;) {
    poll_interrupt();
    const double longest = Chebyshev::stability_limit(most_stages) / std::max(radius_, 1e-300);
    const double dt = fitted(std::min(dt_, longest), end);
    if ((dt != end - here_.t || control_.repeated) && !is_visible(dt))
      throw vanished(trouble_.empty() ? error_ : Vec(), trouble_);
    trouble_.clear();
    const Attempt outcome = attempt(dt);
    if (outcome != Attempt::accepted) {
      ++stats_.rejected;
      control_.repeated = true;
      dt_ = outcome == Attempt::not_finite
                ? dt / 4
                : dt / std::clamp(root(norm_, order + 1) / PredictiveController::safety, 1.1, slowest);
      if (since_spectrum_ > 0) measure_spectrum();
      continue;
    }
    const double quotient =
        control_.quotient(dt, norm_, order + 1, PredictiveController::safety, 1 / fastest, slowest);
    const double proposed = control_.propose(dt, quotient);
    control_.accept(dt, norm_);
    dt_ = dt < as_planned * dt_ && dt_ <= longest ? std::max(proposed, dt_) : proposed;
    if (dt == end - here_.t) next_.t = end;
    std::swap(before_, here_);
    std::swap(here_, next_);
    ++since_spectrum_;
    ++stats_.steps;
    stats_.errors += norm_;
    return;
  }
}

Detail ChebyshevStepper::look(const StepView& step, double t, Detail detail, Point& out) {
  if (t >= step.to.t || t <= step.from.t) {
    out = t >= step.to.t ? step.to : step.from;
    return Detail::full;
  }
  hermite(step, t, out);
  if (problem_->projects())
    problem_->project_if_needed(t, out.x, tolerances_.rtol, tolerances_.atol, Problem::projection_share);
  if (detail == Detail::full) rhs_.require(t, out.x.data(), out.xdot.data(), out.z.data());
  return detail;
}

}  // namespace pendula::integrate
