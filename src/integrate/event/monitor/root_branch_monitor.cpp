#include "integrate/event/monitor/root_branch_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "expr/graph/derivative.hpp"

namespace pendula::integrate {

RootBranchMonitor::RootBranchMonitor(const ProblemPtr& problem, const std::vector<Guard>& guards) {
  std::vector<Expr> outputs, slopes;
  for (const Guard& guard : guards) {
    if (!guard.root) continue;
    const Expr root = pendula::sqrt(guard.factor), slope = total_derivative(root);
    if (!all_known(slope, *problem)) continue;
    roots_.push_back(guard);
    outputs.push_back(root);
    slopes.push_back(slope);
  }
  if (roots_.empty()) return;
  problem_ = std::make_shared<Problem>(*problem);
  outputs.insert(outputs.end(), slopes.begin(), slopes.end());
  kernel_ = codegen::Kernel(outputs, problem->arguments());
  out_.resize(outputs.size());
  samples_.resize(roots_.size());
  largest_.assign(roots_.size(), 0.0);
}

void RootBranchMonitor::start(const Point& point) {
  for (auto& list : samples_) list.clear();
  inspect(point);
}

std::optional<Stop> RootBranchMonitor::inspect(const Point& point) {
  if (roots_.empty()) return {};
  problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), out_.data());
  std::optional<Stop> stop;
  constexpr std::size_t most = 64;
  for (std::size_t i = 0; i < roots_.size(); ++i) {
    const Sample now{point.t, out_[i], out_[roots_.size() + i]};
    if (!std::isfinite(now.s) || !std::isfinite(now.slope)) continue;
    auto& list = samples_[i];
    list.push_back(now);
    if (list.size() > most) list.pop_front();
    largest_[i] = std::max(largest_[i], now.s);
    // D is a difference of terms and known to 10⁻¹³ of its largest value; hence √D to about 10⁻⁶
    constexpr double rounding = 1e-6;
    const auto t = now.s <= rounding * largest_[i] ? std::optional(now.t) : kink(list);
    if (t && (!stop || *t < stop->t)) stop = Stop{*t, roots_[i].reason, *t};
  }
  return stop;
}

/// Searches back from the last point across the minimum of √D for a point of the same size on the other side.
std::optional<double> RootBranchMonitor::kink(const std::deque<Sample>& list) {
  const Sample& right = list.back();
  if (right.slope <= 0 || list.size() < 2) return {};
  for (std::size_t k = list.size() - 1; k-- > 0;) {
    const Sample& left = list[k];
    if (left.slope >= 0) continue;
    // a point as large as the right one separates the two cases best
    if (left.s < right.s / 2 && k > 0 && list[k - 1].s > left.s) continue;
    const double half = (right.t - left.t) / 2;
    const double same = std::fabs(right.s - left.s - half * (left.slope + right.slope));
    const double through = std::fabs(right.s + left.s + half * (left.slope - right.slope));
    if (!(through < same / 4)) return {};
    return left.t + (right.t - left.t) * left.s / (left.s + right.s);
  }
  return {};
}

}  // namespace pendula::integrate
