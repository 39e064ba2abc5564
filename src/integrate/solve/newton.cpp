#include "integrate/solve/newton.hpp"

#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/interrupt.hpp"

namespace pendula::integrate {
namespace {

constexpr int most_iterations = 40;          // a double root takes 26: half the distance each, down to √ε
constexpr double rounding_level = 32 * eps;  // of the terms of an equation
constexpr double stagnation_level = 1e-10;   // of the values; Newton's next correction would be its square
constexpr double smallest_step = 1.0 / 1024;

void scales(const Mat& J, Vec& row, Vec& column) {
  row.setZero(J.rows());
  column.setZero(J.cols());
  for (Eigen::Index j = 0; j < J.cols(); ++j)
    for (Eigen::Index i = 0; i < J.rows(); ++i) row[i] = std::max(row[i], std::fabs(J(i, j)));
  for (double& r : row) r = r > 0 ? 1 / r : 1;
  for (Eigen::Index j = 0; j < J.cols(); ++j) {
    for (Eigen::Index i = 0; i < J.rows(); ++i) column[j] = std::max(column[j], row[i] * std::fabs(J(i, j)));
    column[j] = column[j] > 0 ? 1 / column[j] : 1;
  }
}

constexpr Eigen::Index small = 64;  // above, Eigen's blocked algorithm is faster

}  // namespace

bool ScaledLU::factorise(const Mat& J) {
  if (!J.allFinite()) return false;
  scales(J, row_, column_);
  matrix_ = row_.asDiagonal() * J * column_.asDiagonal();
  if (J.rows() <= small) return factorise_small();
  lu_.compute(matrix_);
  const double smallest = lu_.matrixLU().diagonal().cwiseAbs().minCoeff();
  return smallest > static_cast<double>(J.rows()) * eps;
}

/// Elimination by columns, with the pivots of lu_. Zeros, frequent in Jacobians, are skipped.
bool ScaledLU::factorise_small() {
  const Eigen::Index n = matrix_.rows();
  pivot_.resize(static_cast<std::size_t>(n));
  double smallest = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k < n; ++k) {
    double* below = matrix_.data() + k * n;
    Eigen::Index best = k;
    for (Eigen::Index i = k + 1; i < n; ++i)
      if (std::fabs(below[i]) > std::fabs(below[best])) best = i;
    smallest = std::min(smallest, std::fabs(below[best]));
    if (below[best] == 0) return false;
    pivot_[k] = static_cast<int>(best);
    if (best != k) matrix_.row(k).swap(matrix_.row(best));
    const double reciprocal = below[k] = 1 / below[k];
    for (Eigen::Index i = k + 1; i < n; ++i) below[i] *= reciprocal;
    for (Eigen::Index j = k + 1; j < n; ++j) {
      double* column = matrix_.data() + j * n;
      const double factor = column[k];
      if (factor == 0) continue;
      for (Eigen::Index i = k + 1; i < n; ++i) column[i] -= factor * below[i];
    }
  }
  return smallest > static_cast<double>(n) * eps;
}

void ScaledLU::solve(const Vec& r, Vec& x) {
  scaled_ = row_.cwiseProduct(r);
  const Eigen::Index n = matrix_.rows();
  if (n > small) {
    x = lu_.solve(scaled_);
  } else {
    x = scaled_;
    for (Eigen::Index k = 0; k < n; ++k) std::swap(x[k], x[pivot_[k]]);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double* below = matrix_.data() + k * n;
      if (x[k] == 0) continue;
      for (Eigen::Index i = k + 1; i < n; ++i) x[i] -= x[k] * below[i];
    }
    for (Eigen::Index k = n; k-- > 0;) {
      const double* above = matrix_.data() + k * n;
      x[k] *= above[k];
      for (Eigen::Index i = 0; i < k; ++i) x[i] -= x[k] * above[i];
    }
  }
  x = x.cwiseProduct(column_);
}

void ScaledLU::null_vectors(const Mat& J, Vec& right, Vec& left) {
  Vec row, column;
  scales(J, row, column);
  const Mat scaled = row.asDiagonal() * J * column.asDiagonal();
  const Eigen::JacobiSVD<Mat> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto last = J.rows() - 1;
  right = svd.matrixV().col(last);
  left = svd.matrixU().col(last);
  right /= right.cwiseAbs().maxCoeff();
  left /= left.cwiseAbs().maxCoeff();
}

/// max |rᵢ| relative to the size of its terms, by the current Jacobian; stores the worst equation.
double Newton::measure(const Vec& w) {
  double largest = 0;
  worst_ = 0;
  terms_ = size_;
  for (Eigen::Index j = 0; j < w.size(); ++j) {
    const double size = std::fabs(w[j]);
    for (Eigen::Index i = 0; i < r_.size(); ++i) terms_[i] += std::fabs(J_(i, j)) * size;
  }
  for (Eigen::Index i = 0; i < r_.size(); ++i) {
    if (r_[i] == 0) continue;
    const double relative =
        terms_[i] > 0 ? std::fabs(r_[i]) / terms_[i] : std::numeric_limits<double>::infinity();
    if (relative > largest) {
      largest = relative;
      worst_ = static_cast<int>(i);
    }
  }
  return largest;
}

/// The norm of a correction relative to w; components much smaller than the largest are
/// prevented from dominating.
double Newton::length(const Vec& step, const Vec& w) const {
  const double floor = 1e-3 * w.lpNorm<Eigen::Infinity>() + std::numeric_limits<double>::min();
  double largest = 0;
  for (Eigen::Index j = 0; j < step.size(); ++j)
    largest = std::max(largest, std::fabs(step[j]) / std::max(std::fabs(w[j]), floor));
  return std::isfinite(largest) ? largest : std::numeric_limits<double>::infinity();
}

/// Is the correction explained by the rounding of the equations' terms? A constraint known to ε|q| determines
/// velocities to ε|q|/Δt, whatever their size.
bool Newton::is_rounding(const Vec& w) {
  measure(w);
  for (int attempt = 0; attempt < 2; ++attempt) {
    for (Eigen::Index i = 0; i < terms_.size(); ++i)
      trial_r_[i] = ((i * (attempt + 1)) % 3 == 0 ? -1 : 1) * rounding_level * terms_[i];
    lu_.solve(trial_r_, simplified_);
    if (length(step_, w) <= length(simplified_, w)) return true;
  }
  return false;
}

/// Moves w along step_ by the largest λ = 1, 1/2, … that passes the monotonicity test.
Newton::Trial Newton::search(Equations& equations, Vec& w) {
  for (double lambda = 1; lambda >= smallest_step; lambda /= 2) {
    poll_interrupt();
    trial_ = w + lambda * step_;
    equations.residual(trial_, trial_r_);
    if (!trial_r_.allFinite()) continue;
    lu_.solve(trial_r_, simplified_);
    // Both norms relative to the same point; otherwise no step away from w = 0 could be accepted.
    const double before = length(step_, trial_), after = length(simplified_, trial_);
    // After so short a correction quadratic convergence would leave nothing. The rest is rounding, which does
    // not decrease monotonically.
    const bool noise = lambda == 1 && before <= stagnation_level && after > before / 4;
    if (!noise && after > (1 - lambda / 4) * before) continue;
    w.swap(trial_);
    r_.swap(trial_r_);
    return noise || (lambda == 1 && after <= 2 * eps) ? Trial::settled : Trial::accepted;
  }
  return Trial::failed;
}

NewtonResult Newton::solve(Equations& equations, Vec& w) {
  const auto n = w.size();
  J_.resize(n, n);
  r_.resize(n);
  size_.resize(n);
  step_.resize(n);
  trial_r_.resize(n);
  simplified_.resize(n);
  NewtonResult result;
  equations.residual(w, r_);
  const auto finish = [&](Outcome outcome) {
    result.outcome = outcome;
    result.residual = r_.lpNorm<Eigen::Infinity>();
    result.worst = worst_;
    return result;
  };
  if (!r_.allFinite()) {
    for (worst_ = 0; std::isfinite(r_[worst_]);) ++worst_;
    return finish(Outcome::not_finite);
  }
  double previous = std::numeric_limits<double>::infinity();
  while (result.iterations < most_iterations) {
    equations.jacobian(w, J_, size_);
    const double now = measure(w);
    if (now <= rounding_level) return finish(Outcome::converged);
    if (now <= stagnation_level && now > previous / 2) return finish(Outcome::converged);
    previous = now;
    ++result.factorisations;
    if (!lu_.factorise(J_)) return finish(J_.allFinite() ? Outcome::singular : Outcome::not_finite);
    lu_.solve(r_, step_);
    step_ = -step_;
    ++result.iterations;
    const Trial trial = search(equations, w);
    if (trial == Trial::settled) return finish(Outcome::converged);
    if (trial == Trial::failed)
      return finish(now <= stagnation_level || is_rounding(w) ? Outcome::converged : Outcome::diverged);
    // with the old Jacobian, which saves a new one
    if (measure(w) <= rounding_level) return finish(Outcome::converged);
  }
  return finish(Outcome::diverged);
}

}  // namespace pendula::integrate
