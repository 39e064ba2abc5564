#include "integrate/projection.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "expr/print.hpp"

namespace pendula::integrate {

using Index = Eigen::Index;

Projector::Projector(const dae::Projection& stage, std::span<const Expr> states,
                     std::span<const Expr> arguments)
    : jacobian_(stage.jacobian), weighted_(stage.weight.size() > 0), residuals_(stage.residuals.size()) {
  for (Expr unknown : stage.unknowns) {
    const auto at = std::find(states.begin(), states.end(), unknown);
    PENDULA_ASSERT(at != states.end(), "a projection moves something that is not a state");
    moved_.push_back(static_cast<std::size_t>(at - states.begin()));
  }
  conditions_ =
      stage.residuals.size() == 1 ? to_text(stage.residuals[0]) : vector_to_text(column(stage.residuals));
  std::vector<Expr> outputs = stage.residuals;
  for (const pendula::Entry& e : jacobian_) outputs.push_back(e.value);
  if (weighted_)
    for (Index i = 0; i < stage.weight.rows(); ++i)
      for (Index j = 0; j < stage.weight.cols(); ++j) outputs.push_back(stage.weight(i, j));
  kernel_ = codegen::Kernel(outputs, arguments);
}

void Projector::assemble(const std::vector<double>& numbers, Mat& K, Vec& right) const {
  const auto n = static_cast<Index>(moved_.size()), m = static_cast<Index>(residuals_);
  K.setZero();
  right.setZero();
  auto number = numbers.begin();
  for (Index i = 0; i < m; ++i) right[n + i] = -*number++;
  for (const pendula::Entry& e : jacobian_) K(n + e.row, e.column) = K(e.column, n + e.row) = *number++;
  if (!weighted_) {
    K.topLeftCorner(n, n).setIdentity();
    return;
  }
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) K(i, j) = *number++;
}

void Projector::run(std::vector<double>& values, std::size_t first_state) const {
  constexpr int most_steps = 30;
  const auto n = static_cast<Index>(moved_.size()), size = n + static_cast<Index>(residuals_);
  std::vector<double> numbers(kernel_.outputs());
  Mat K(size, size);
  Vec right(size);
  for (int k = 0; k < most_steps; ++k) {
    kernel_(values.data(), numbers.data());
    assemble(numbers, K, right);
    if (!K.allFinite() || !right.allFinite()) break;
    const Vec step = K.partialPivLu().solve(right).head(n);
    if (!step.allFinite()) break;
    double largest = 0;
    for (Index j = 0; j < n; ++j) {
      double& x = values[first_state + moved_[static_cast<std::size_t>(j)]];
      x += step[j];
      largest = std::max(largest, std::fabs(x));
    }
    const double rounding = k < 4 ? 1e-14 : 1e-11;  // badly scaled constraints stay at their own rounding
    if (step.cwiseAbs().maxCoeff() <= rounding * (1 + largest)) return;
  }
  throw Failure(text("the state could not be moved back onto 0 = ", conditions_,
                     ": it is too far away, or the constraints are singular there. Try a smaller dt"));
}

}  // namespace pendula::integrate
