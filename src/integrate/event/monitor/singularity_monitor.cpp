#include "integrate/event/monitor/singularity_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/search/golden_section.hpp"
#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

constexpr double gone = 1e-3;  // relative to the value at the start; smaller values count as zero

SingularityMonitor::SingularityMonitor(const ProblemPtr& problem, const std::vector<Guard>& guards)
    : guards_(guards) {
  if (guards.empty()) return;
  problem_ = std::make_shared<Problem>(*problem);
  std::vector<Expr> outputs, slopes;
  for (const Guard& guard : guards) {
    outputs.push_back(guard.factor);
    const Expr slope = total_derivative(guard.factor);
    slopes.push_back(all_known(slope, *problem) ? slope : Expr(0));
  }
  outputs.insert(outputs.end(), slopes.begin(), slopes.end());
  kernel_ = codegen::Kernel(outputs, problem->arguments());
  out_.resize(outputs.size());
}

SingularityMonitor::Sample SingularityMonitor::evaluate(const Point& point) {
  if (guards_.empty()) return {};
  problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), out_.data());
  const auto middle = out_.begin() + static_cast<std::ptrdiff_t>(guards_.size());
  return {{out_.begin(), middle}, {middle, out_.end()}};
}

void SingularityMonitor::start(const Point& point) {
  if (guards_.empty()) return;
  last_ = point;
  here_ = evaluate(point);
  first_ = here_.g;
}

double SingularityMonitor::value_between(const Point& end, double share, std::size_t which) {
  hermite(last_, end, share, between_);
  return evaluate(between_).g[which];
}

/// The zero of the divisor, as a share of the step; empty if there is none.
std::optional<double> SingularityMonitor::zero(const Point& end, const Sample& there, std::size_t i) {
  const double a = here_.g[i], b = there.g[i];
  if (b == 0) return 1;
  if (a == 0 || !std::isfinite(a) || !std::isfinite(b)) return {};
  if ((a < 0) == (b < 0)) {
    const bool minimum = a * here_.slope[i] < 0 && b * there.slope[i] > 0;
    return minimum ? zero_of_minimum(end, a, b, i) : std::nullopt;
  }
  double low = 0, high = 1;
  for (int k = 0; k < 50; ++k) {
    const double middle = (low + high) / 2, g = value_between(end, middle, i);
    ((g < 0) == (a < 0) && g != 0 ? low : high) = middle;
  }
  return high;
}

/// The minimum of |g| by golden section search, if it is zero to within 1e-9.
std::optional<double> SingularityMonitor::zero_of_minimum(const Point& end, double a, double b,
                                                          std::size_t i) {
  const auto size = [&](double share) { return std::fabs(value_between(end, share, i)); };
  const double share = golden_section(size, 0, 1, 80).middle(), least = value_between(end, share, i);
  const bool reached =
      (least < 0) != (a < 0) || std::fabs(least) <= 1e-9 * std::max(std::fabs(a), std::fabs(b));
  return reached ? std::optional(share) : std::nullopt;
}

std::optional<Stop> SingularityMonitor::after(const MonitoredStep& step) {
  if (guards_.empty()) return {};
  const Sample there = evaluate(step.here);
  std::optional<double> first;
  std::size_t which = 0;
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    const auto share = zero(step.here, there, i);
    if (!share || (first && *share >= *first)) continue;
    first = share;
    which = i;
  }
  if (first) return Stop{last_.t + *first * (step.here.t - last_.t), guards_[which].reason, last_.t};
  last_ = step.here;
  before_ = std::exchange(here_, there).g;
  return {};
}

std::string SingularityMonitor::almost_zero(const Point& point, double almost, bool vanished) {
  constexpr double last_bits = 16 * std::numeric_limits<double>::epsilon();
  if (first_.empty()) return "";
  const Sample there = evaluate(point);
  for (std::size_t i = 0; i < first_.size(); ++i) {
    const bool none = std::fabs(there.g[i]) <= gone * std::fabs(first_[i]);
    if (vanished && !none) continue;
    // extrapolated by two steps
    const double ahead = before_.empty() ? there.g[i] : 3 * there.g[i] - 2 * before_[i];
    const bool small = std::fabs(there.g[i]) <= almost * std::fabs(first_[i]);
    if (!small && (ahead < 0) == (there.g[i] < 0)) continue;
    std::string reason = guards_[i].reason;
    const bool rounding = std::fabs(there.g[i]) <= last_bits * std::fabs(first_[i]);
    if (rounding || (none && !(evaluate(a_moment_after(point)).g[i] * there.g[i] > 0))) return ". " + reason;
    const std::string zero = " = 0 there, and ";
    const std::string now = none    ? " is almost 0 there"
                            : small ? " is only " + rounded(there.g[i], 1) + " there"
                                    : " heads for 0";
    return ". " + reason.replace(reason.find(zero), zero.size(), now + "; where it is 0, ");
  }
  return "";
}

std::string near_singularity(SingularityMonitor& divisors, RankMonitor& ranks, const Point& point,
                             double almost) {
  if (const std::string found = divisors.almost_zero(point, almost, true); !found.empty()) return found;
  if (almost > gone)
    if (const std::string found = ranks.almost_lost(point); !found.empty()) return found;
  return divisors.almost_zero(point, almost, false);
}

}  // namespace pendula::integrate
