#include "base/search/least_squares.hpp"

#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/triangular_factor.hpp"

namespace pendula {
namespace {

using Eigen::Index;

/// The steps p(λ) = argmin ‖R p + q‖² + λ‖D p‖² in the coordinates D p, where R D⁻¹ = U Σ Vᵀ.
class Steps {
 public:
  Steps(const QuadraticModel& m, const Vec& D, double accuracy)
      : D_(D), svd_(m.R * D.cwiseInverse().asDiagonal(), Eigen::ComputeFullU | Eigen::ComputeFullV) {
    sigma_ = svd_.singularValues();
    c_ = svd_.matrixU().transpose() * m.q;
    for (Index i = 0; i < sigma_.size(); ++i)
      if (sigma_[i] <= accuracy * sigma_[0]) sigma_[i] = c_[i] = 0;
  }

  /// ½‖q‖² over the directions in which V changes: the predicted decrease of a full step.
  double promise() const { return 0.5 * c_.squaredNorm(); }
  double promise(double lambda) const {
    double sum = 0;
    for (Index i = 0; i < sigma_.size(); ++i) {
      if (sigma_[i] == 0) continue;
      const double s2 = sigma_[i] * sigma_[i];
      sum += c_[i] * c_[i] * s2 * (s2 + 2 * lambda) / std::pow(s2 + lambda, 2) / 2;
    }
    return sum;
  }
  double length(double lambda) const { return coordinates(lambda).norm(); }
  Vec step(double lambda) const { return (svd_.matrixV() * coordinates(lambda)).cwiseQuotient(D_); }

  /// λ with ‖D p(λ)‖ = radius to within 10 %, 0 if the full step is not longer: Newton's method on 1/‖D
  /// p(λ)‖, which is concave, from the left (Moré 1977, §5; Nocedal & Wright, §4.3).
  double damping(double radius) const {
    double lambda = 0, size = length(0);
    if (size <= 1.1 * radius) return 0;
    for (int k = 0; k < 100 && std::fabs(size - radius) > 0.1 * radius; ++k) {
      double slope = 0;  // of ‖D p‖²/2
      for (Index i = 0; i < sigma_.size(); ++i)
        if (sigma_[i] > 0)
          slope -= std::pow(c_[i] * sigma_[i], 2) / std::pow(sigma_[i] * sigma_[i] + lambda, 3);
      lambda += (size - radius) / radius * size * size / -slope;
      size = length(lambda);
    }
    return lambda;
  }

 private:
  Vec coordinates(double lambda) const {
    Vec z(sigma_.size());
    for (Index i = 0; i < z.size(); ++i)
      z[i] = sigma_[i] > 0 ? -sigma_[i] * c_[i] / (sigma_[i] * sigma_[i] + lambda) : 0;
    return z;
  }
  Vec D_, sigma_, c_;
  Eigen::JacobiSVD<Mat> svd_;
};

class Search {
 public:
  Search(const SmoothFunction& V, Vec start, const MinimiserOptions& options)
      : V_(V), options_(options), D_(Vec::Zero(start.size())) {
    auto first = V_(start);
    if (!first || !std::isfinite(first->value))
      throw Error(
          "the sum of squares is not finite where the search starts: start elsewhere, or scale the data "
          "(numbers above 1e154 overflow when they are squared)");
    out_.theta = std::move(start);
    at_ = std::move(*first);
    out_.values.push_back(at_.value);
  }

  Minimum run() {
    bool goes_on = true;
    while (goes_on) {
      poll_interrupt();
      rescale();
      const Steps steps(at_, D_, options_.accuracy);
      out_.angle = at_.value > 0 ? std::sqrt(steps.promise() / at_.value) : 0;
      if (!radius_) radius_ = 10 * std::max(size(out_.theta), at_.q.norm());
      if (options_.is_known && options_.is_known(out_.theta, D_))
        goes_on = end(Ending::known);
      else if (steps.promise() == 0)
        goes_on = end(Ending::converged);
      else if (out_.iterations >= options_.iterations)
        goes_on = end(Ending::iterations);
      else
        goes_on = advance(steps);
    }
    out_.value = at_.value;
    return std::move(out_);
  }

 private:
  double size(const Vec& p) const { return p.cwiseProduct(D_).norm(); }
  bool end(Ending e) {
    out_.ending = e;
    return false;
  }

  void rescale() {
    D_ = D_.cwiseMax(at_.R.colwise().norm().transpose());
    for (double& d : D_)
      if (d == 0) d = 1;
  }

  /// One accepted step; false at the end of the search.
  bool advance(const Steps& steps) {
    constexpr double last_digits = 1e-10;  // a full step this small relative to θ
    const bool settling = steps.promise() <= options_.noise * std::fabs(at_.value) ||
                          steps.length(0) <= last_digits * size(out_.theta);
    bool refused = false;
    for (;;) {
      const double lambda = settling ? 0 : steps.damping(*radius_);
      const Vec p = steps.step(lambda);
      const double length = size(p), whole = size(out_.theta);
      if (learns() && (settling || !(length > 1e-15 * whole))) return forget_curvature();
      if (settling && !(length < 0.9 * last_)) return end(Ending::converged);
      if (!(length > 1e-15 * whole)) return end(verdict(steps, refused));
      Vec there = out_.theta + p;
      auto next = V_(there);
      const bool defined = next && std::isfinite(next->value) && next->R.allFinite() && next->q.allFinite();
      if (settling) {
        if (!defined || next->value > at_.value * (1 + options_.noise)) return end(Ending::converged);
        return accept(there, length, std::move(*next));
      }
      const double promise = steps.promise(lambda);  // 0 where it underflows
      const double gain = defined && promise > 0 ? (at_.value - next->value) / promise : -1;
      refused = !defined;
      radius_ = gain < 0.25 ? 0.25 * length : gain > 0.75 ? std::max(*radius_, 3 * length) : *radius_;
      if (gain > 1e-4) return accept(there, length, std::move(*next));
    }
  }

  /// The verdict if no further step is possible.
  Ending verdict(const Steps& steps, bool refused) const {
    if (steps.promise() <= 10 * options_.noise * std::fabs(at_.value)) return Ending::converged;
    // an error ε of V hides a minimum at distance √ε; if V itself is rounding, ε is V
    if (!refused && steps.length(0) <= std::sqrt(options_.noise) * size(out_.theta)) return Ending::converged;
    return refused ? Ending::boundary : Ending::stalled;
  }

  bool accept(const Vec& there, double length, QuadraticModel next) {
    slow_ = length > 0.5 * last_ ? slow_ + 1 : slow_ > most_slow ? slow_ : 0;
    if (learns()) learn_curvature(there - out_.theta, next);
    out_.theta = there;
    at_ = std::move(next);
    last_ = length;
    ++out_.iterations;
    out_.values.push_back(at_.value);
    return true;
  }

  /// Replaces the curvature of `next` by the BFGS update of the last one: it satisfies B p = g(θ + p) - g(θ)
  /// and stays positive definite where pᵀ(g(θ + p) - g(θ)) > 0.
  void learn_curvature(const Vec& p, QuadraticModel& next) const {
    const Vec g = next.R.transpose() * next.q, y = g - at_.R.transpose() * at_.q, Rp = at_.R * p;
    const double along = y.dot(p);
    if (!(along > 1e-12 * y.norm() * p.norm()) || !(Rp.squaredNorm() > 0)) return;
    const Vec Bp = at_.R.transpose() * Rp;
    const Mat B =
        at_.R.transpose() * at_.R + y * y.transpose() / along - Bp * Bp.transpose() / Rp.squaredNorm();
    next = newton_model(next.value, g, B);
  }

  /// In a narrow valley, where JᵀJ is accurate but steps are short, prolonged updates do harm.
  bool learns() const {
    const int enough = 20 + 10 * static_cast<int>(out_.theta.size());
    return slow_ > most_slow && slow_ <= most_slow + enough && forgotten_ < most_forgotten;
  }

  /// Returns to the curvature JᵀJ, on which every verdict is based.
  bool forget_curvature() {
    if (auto fresh = V_(out_.theta)) at_ = std::move(*fresh);
    slow_ = 0;
    last_ = std::numeric_limits<double>::infinity();
    radius_ = std::max(*radius_, 1e-3 * size(out_.theta));
    ++forgotten_;
    return true;
  }

  static constexpr int most_slow = 4, most_forgotten = 3;
  const SmoothFunction& V_;
  const MinimiserOptions& options_;
  Minimum out_;
  QuadraticModel at_;
  Vec D_;
  std::optional<double> radius_;                           // Δ
  double last_ = std::numeric_limits<double>::infinity();  // length of the last accepted step
  int forgotten_ = 0;
  int slow_ = 0;  // consecutive accepted steps that hardly shrank
};

}  // namespace

QuadraticModel gauss_newton_model(const Mat& J, const Vec& r) {
  const TriangularFactor factor = triangular_factor(J, r);
  const Index d = J.cols();
  return {0.5 * r.squaredNorm(), factor.R().topLeftCorner(d, d), factor.R().col(d).head(d)};
}

QuadraticModel newton_model(double value, const Vec& gradient, const Mat& hessian) {
  const Eigen::SelfAdjointEigenSolver<Mat> eigen(hessian);
  const double largest = eigen.eigenvalues().cwiseAbs().maxCoeff();
  const double floor = largest > 0 ? std::numeric_limits<double>::epsilon() * largest : 1;
  const Vec root = eigen.eigenvalues().cwiseAbs().cwiseMax(floor).cwiseSqrt();
  const Mat R = root.asDiagonal() * eigen.eigenvectors().transpose();
  return {value, R, (eigen.eigenvectors().transpose() * gradient).cwiseQuotient(root)};
}

Minimum minimise(const SmoothFunction& V, Vec start, const MinimiserOptions& options) {
  return Search(V, std::move(start), options).run();
}

std::string ending_text(const Minimum& m) {
  switch (m.ending) {
    case Ending::converged:
    case Ending::known:
      return "";
    case Ending::boundary:
      return "stopped at the edge of the admissible parameters, where the loss still falls";
    case Ending::stalled:
      return "stopped where no step lowers the loss, before it converged";
    case Ending::iterations:
      break;
  }
  return text("stopped after ", m.iterations, m.iterations == 1 ? " iteration" : " iterations",
              " before it converged");
}

}  // namespace pendula
