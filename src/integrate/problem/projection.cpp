#include "integrate/problem/projection.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/error.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {

using Index = Eigen::Index;

Projector::Projector(const dae::Projection& stage, std::span<const Expr> states,
                     std::span<const Expr> arguments)
    : stage_(stage), residuals_(stage.residuals.size()) {
  std::unordered_map<Expr, std::size_t> position;
  for (std::size_t i = 0; i < states.size(); ++i) position.emplace(states[i], i);
  for (Expr unknown : stage.unknowns) {
    const auto at = position.find(unknown);
    PENDULA_ASSERT(at != position.end(), "a projection moves something that is not a state");
    moved_.push_back(at->second);
  }
  std::vector<Expr> outputs = stage.residuals;
  for (const pendula::Entry& e : stage.jacobian) {
    outputs.push_back(e.value);
    jacobian_.push_back({e.row, e.column});
  }
  for (const pendula::Entry& e : stage.weight) {
    outputs.push_back(e.value);
    weights_.push_back({e.row, e.column});
  }
  kernel_ = codegen::Kernel(outputs, arguments);
  residual_kernel_ = codegen::Kernel(stage.residuals, arguments);
}

Projector::Projector(const Projector& other)
    : stage_(other.stage_),
      moved_(other.moved_),
      jacobian_(other.jacobian_),
      weights_(other.weights_),
      residuals_(other.residuals_),
      kernel_(other.kernel_),
      residual_kernel_(other.residual_kernel_),
      last_jacobian_(other.last_jacobian_) {}

void Projector::prepare() {
  if (!matrix_.empty()) return;
  const int n = static_cast<int>(moved_.size()), size = n + static_cast<int>(residuals_);
  std::vector<Position> pattern;
  for (const Position& p : jacobian_) {
    pattern.push_back({n + p.row, p.column});
    pattern.push_back({p.column, n + p.row});
  }
  if (stage_.weight.size() == 0)
    for (int i = 0; i < n; ++i) pattern.push_back({i, i});
  for (const Position& p : weights_) pattern.push_back(p);
  solver_.analyse(size, pattern);
  matrix_.assign(pattern.size(), 1);
  numbers_.resize(kernel_.outputs());
  right_.resize(static_cast<std::size_t>(size));
  conditions_now_.resize(residuals_);
}

bool Projector::holds(const std::vector<double>& values, std::size_t first_state, const Vec& rtol,
                      const Vec& atol, double share) {
  if (last_jacobian_.empty()) return false;
  prepare();
  residual_kernel_(values.data(), conditions_now_.data());
  std::fill(right_.begin(), right_.end(), 0.0);
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    const std::size_t j = moved_[jacobian_[k].column];
    const auto i = static_cast<Index>(j);
    right_[jacobian_[k].row] +=
        std::fabs(last_jacobian_[k]) * (atol[i] + rtol[i] * std::fabs(values[first_state + j]));
  }
  for (std::size_t i = 0; i < residuals_; ++i)
    if (!(std::fabs(conditions_now_[i]) <= share * right_[i])) return false;
  return true;
}

/// One Newton step; false if the matrix is singular or a value is not finite.
bool Projector::correct(std::vector<double>& values, std::size_t first_state, double& moved,
                        double& largest) {
  const std::size_t n = moved_.size();
  kernel_(values.data(), numbers_.data());
  std::fill(right_.begin(), right_.end(), 0.0);
  const double* number = numbers_.data();
  for (std::size_t i = 0; i < residuals_; ++i) right_[n + i] = -*number++;
  last_jacobian_.assign(number, number + jacobian_.size());
  double* entry = matrix_.data();
  for (std::size_t k = 0; k < jacobian_.size(); ++k, ++number) *entry++ = *number, *entry++ = *number;
  if (stage_.weight.size() == 0) entry += n;  // keeps the identity
  std::copy_n(number, weights_.size(), entry);
  if (!solver_.factorise(matrix_.data())) return false;
  solver_.solve(right_.data());
  moved = largest = 0;
  for (std::size_t j = 0; j < n; ++j) {
    if (!std::isfinite(right_[j])) return false;
    double& x = values[first_state + moved_[j]];
    x += right_[j];
    moved = std::max(moved, std::fabs(right_[j]));
    largest = std::max(largest, std::fabs(x));
  }
  return true;
}

std::string Projector::conditions() const {
  const std::vector<Expr>& r = stage_.residuals;
  return r.size() == 1 ? to_text(r[0]) : vector_to_text(column(r));
}

void Projector::run(std::vector<double>& values, std::size_t first_state) {
  constexpr int most_steps = 30;
  prepare();
  for (int k = 0; k < most_steps; ++k) {
    double moved = 0, largest = 0;
    if (!correct(values, first_state, moved, largest)) break;
    // corrections of badly scaled constraints stay at the level of their rounding errors
    const double rounding = k < 4 ? 1e-14 : 1e-11;
    if (moved <= rounding * (1 + largest)) return;
  }
  throw Failure(text("the state could not be moved back onto 0 = ", conditions(),
                     ": it is too far away, or the constraints are singular there. Try a smaller dt"));
}

}  // namespace pendula::integrate
