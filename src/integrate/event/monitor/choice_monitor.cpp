#include "integrate/event/monitor/choice_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::integrate {

constexpr double small_share = 0.01;  // relative to the largest value so far; larger values are not examined
constexpr int steps_required = 3;     // steps; a single step that passes near 0 does not count

ChoiceMonitor::ChoiceMonitor(const ProblemPtr& problem, const std::vector<Guard>& choices,
                             const Tolerances& tolerances)
    : guards_(choices), tolerances_(tolerances) {
  if (guards_.empty()) return;
  problem_ = std::make_shared<Problem>(*problem);
  std::vector<Expr> factors;
  for (const Guard& guard : guards_) factors.push_back(guard.factor);
  kernel_ = codegen::Kernel(factors, problem->arguments());
  g_.resize(factors.size());
  moved_.resize(factors.size());
}

void ChoiceMonitor::evaluate(const Point& point, std::vector<double>& g) {
  problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), g.data());
}

void ChoiceMonitor::start(const Point& point) {
  evaluate(point, g_);
  seen_.assign(g_.size(), {});
  for (std::size_t i = 0; i < g_.size(); ++i) seen_[i].largest = std::fabs(g_[i]);
}

/// Change of each guard when one state is perturbed by its tolerance and x′ and z are solved for; infinite
/// where the perturbed equations have no solution.
std::vector<double> ChoiceMonitor::uncertainties(const Point& point, const std::vector<double>& g) {
  if (!solver_) solver_ = std::make_unique<RhsSolver>(problem_, ignored_);
  std::vector<double> largest(g.size(), 0);
  for (Eigen::Index k = 0; k < point.x.size(); ++k) {
    const double error = tolerances_.atol[k] + tolerances_.rtol[k] * std::fabs(point.x[k]);
    for (const double sign : {1.0, -1.0}) {
      Point p = point;
      p.x[k] += sign * error;
      try {
        solver_->require(p.t, p.x.data(), p.xdot.data(), p.z.data());
        evaluate(p, moved_);
        for (std::size_t i = 0; i < g.size(); ++i)
          largest[i] = std::max(largest[i], std::fabs(moved_[i] - g[i]));
      } catch (const Failure&) {
        std::fill(largest.begin(), largest.end(), INFINITY);
        return largest;
      }
    }
  }
  return largest;
}

std::optional<Stop> ChoiceMonitor::after(const MonitoredStep& step) {
  evaluate(step.here, g_);
  const std::vector<double> g = g_;
  std::vector<double> uncertain;
  for (std::size_t i = 0; i < g.size(); ++i) {
    Seen& seen = seen_[i];
    seen.largest = std::max(seen.largest, std::fabs(g[i]));
    const bool small = std::fabs(g[i]) <= small_share * seen.largest;
    if (small && uncertain.empty()) uncertain = uncertainties(step.here, g);
    seen.close = small && uncertain[i] >= std::fabs(g[i]) ? seen.close + 1 : 0;
    if (seen.close == steps_required)
      return Stop{step.here.t, text("within the tolerances ", guards_[i].reason), step.before.t};
  }
  return {};
}

}  // namespace pendula::integrate
