#include "integrate/run/border_jump.hpp"

#include <algorithm>
#include <cmath>

#include "expr/graph/derivative.hpp"

namespace pendula::integrate {
namespace {

/// Distances δ, in units of the unknowns, at which F is compared on both sides of the border. The near one
/// starts at the limit set by rounding. Between the far and the near distance a continuous difference shrinks
/// at least like a root; a jump does not shrink.
constexpr double far = 1e-3, nearest = 1e-9, farthest = 1e-8;
constexpr double shrunk = 0.01;  // √(10⁻⁸/10⁻³) and less
constexpr double floor = 1e-10;  // relative to the terms of F: rounding of long sums

}  // namespace

bool BorderJump::is_continuous(int event, const Point& point) {
  const Plan& plan = state_.plan;
  if (!plan.treat) return false;
  if (!live_) {
    live_ = plan.treat(std::vector<Treatment>(plan.events.list.size(), Treatment::unfrozen), {}).problem;
  }
  const Vec n = direction(event, point);
  if (!n.allFinite() || n.isZero(0)) return false;
  const Eigen::Map<const Vec> slopes(directions_.at(event).numbers.data(), n.size());
  const Point on = moved(point, -condition(event, point) / slopes.dot(n) * n);
  double near = nearest;
  while (condition(event, moved(on, near * n)) * condition(event, moved(on, -near * n)) >= 0)
    if ((near *= 10) > farthest) return false;  // the border is hidden by rounding errors
  const Vec wide = difference(on, n, far), narrow = difference(on, n, near), least = rounding(on);
  for (Eigen::Index i = 0; i < narrow.size(); ++i) {
    const double allowed = std::max(std::isfinite(wide[i]) ? shrunk * std::fabs(wide[i]) : 0.0, least[i]);
    if (!(std::fabs(narrow[i]) <= allowed)) return false;
  }
  return true;
}

/// The gradient of g in units w of the unknowns, scaled to 1: wᵢ ∂g/∂yᵢ over its largest entry, times wᵢ; y =
/// (t, x, x′, z).
Vec BorderJump::direction(int event, const Point& point) {
  const dae::FirstOrder& model = state_.problem->model();
  auto& [kernel, numbers] = directions_[event];
  if (numbers.empty()) {
    std::vector<Expr> unknowns{time_symbol()};
    for (const auto* group : {&model.x, &model.xdot, &model.z})
      unknowns.insert(unknowns.end(), group->begin(), group->end());
    std::vector<Expr> outputs = gradient(state_.plan.events.list[event].when, unknowns);
    outputs.push_back(state_.plan.events.list[event].when);
    kernel = codegen::Kernel(outputs, state_.problem->arguments());
    numbers.resize(outputs.size());
  }
  live_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel(live_->values().data(), numbers.data());
  const Eigen::Index n = point.x.size(), m = point.z.size();
  const Tolerances& tolerances = state_.plan.tolerances;
  const auto smallest = [&](Eigen::Index i) {  // the unit of an unknown that is 0
    return tolerances.rtol[i] > 0 ? tolerances.atol[i] / tolerances.rtol[i] : 1.0;
  };
  Vec size(1 + 2 * n + m);
  size[0] = state_.interval();
  for (Eigen::Index i = 0; i < n; ++i) {
    size[1 + i] = std::max(std::fabs(point.x[i]), smallest(i));
    size[1 + n + i] = std::max(std::fabs(point.xdot[i]), smallest(i) / state_.interval());
  }
  for (Eigen::Index i = 0; i < m; ++i) size[1 + 2 * n + i] = std::max(std::fabs(point.z[i]), smallest(n + i));
  const Vec scaled = size.cwiseProduct(Eigen::Map<const Vec>(numbers.data(), size.size()));
  const double largest = scaled.cwiseAbs().maxCoeff();
  if (!(largest > 0)) return Vec::Zero(size.size());
  return size.cwiseProduct(scaled) / largest;
}

Point BorderJump::moved(const Point& point, const Vec& by) {
  const Eigen::Index n = point.x.size(), m = point.z.size();
  return {point.t + by[0], point.x + by.segment(1, n), point.xdot + by.segment(1 + n, n),
          point.z + by.tail(m)};
}

double BorderJump::condition(int event, const Point& point) {
  auto& [kernel, numbers] = directions_.at(event);
  std::vector<double> all(numbers.size());
  live_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel(live_->values().data(), all.data());
  return all.back();
}

Vec BorderJump::difference(const Point& point, const Vec& direction, double distance) {
  Vec result = Vec::Zero(point.x.size() + point.z.size()), F = result;
  for (const double side : {1.0, -1.0}) {
    const Point there = moved(point, side * distance * direction);
    live_->set_point(there.t, there.x.data(), there.xdot.data(), there.z.data());
    live_->residual(F.data());
    result += side * F;
  }
  return result;
}

/// The rounding error of F: a share of Σ |∂F/∂y| |y|.
Vec BorderJump::rounding(const Point& point) {
  const int n = live_->n();
  live_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  const std::vector<double>& J = live_->jacobian();
  Vec sum = Vec::Zero(n + live_->m());
  for (std::size_t k = 0; k < J.size(); ++k) {
    const auto [row, column] = live_->pattern()[k];
    const double y = column < n       ? point.x[column]
                     : column < 2 * n ? point.xdot[column - n]
                                      : point.z[column - 2 * n];
    if (std::isfinite(J[k])) sum[row] += std::fabs(J[k] * y);
  }
  return floor * sum;
}

}  // namespace pendula::integrate
