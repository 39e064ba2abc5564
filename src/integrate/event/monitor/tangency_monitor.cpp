#include "integrate/event/monitor/tangency_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::integrate {

TangencyMonitor::TangencyMonitor(const ProblemPtr& problem, const std::vector<Event>& events,
                                 const EventFinder& finder, const Tolerances& tolerances)
    : problem_(problem), events_(events), finder_(finder), tolerances_(tolerances) {
  empty_ = std::none_of(events.begin(), events.end(),
                        [](const Event& event) { return !event.termination_reason.empty(); });
}

std::optional<Stop> TangencyMonitor::after(const MonitoredStep& step) {
  if (empty_) return {};
  constexpr double near = 0.01;  // of the largest value so far: larger minima are none of our business
  constexpr double within = 10;  // tolerances: the errors of steps add up
  const std::vector<double>& g = finder_.values();
  std::optional<Stop> stop;
  const bool fresh = seen_.size() != g.size();
  if (fresh) seen_.assign(g.size(), {});
  for (std::size_t i = 0; i < g.size(); ++i) {
    const std::string& reason = events_[i].termination_reason;
    if (reason.empty()) continue;
    Values& seen = seen_[i];
    const double size = std::fabs(seen.last);
    const bool turned =
        !fresh && g[i] * seen.last > 0 && size <= std::fabs(seen.before) && size < std::fabs(g[i]);
    if (turned && !stop && size <= near * seen.largest && size <= within * uncertainty(i, step.before))
      stop = Stop{step.before.t,
                  text("within the tolerances (", rounded(size, 1), ") ", reason,
                       "; if the solution only comes near, ask for smaller tolerances or go on with ",
                       "guards = false"),
                  step.before.t};
    seen.before = fresh ? 0 : seen.last;
    seen.last = g[i];
    seen.largest = std::max(seen.largest, std::fabs(g[i]));
  }
  return stop;
}

/// Σ |∂g/∂yⱼ| (atolⱼ + rtolⱼ |yⱼ|) over y = (x, z).
double TangencyMonitor::uncertainty(std::size_t which, const Point& point) {
  const auto& model = problem_->model();
  if (gradients_.empty()) gradients_.resize(events_.size());
  if (gradients_[which].outputs() == 0) {
    std::vector<Expr> unknowns = model.x;
    unknowns.insert(unknowns.end(), model.z.begin(), model.z.end());
    gradients_[which] = codegen::Kernel(gradient(events_[which].when, unknowns), problem_->arguments());
  }
  problem_->place(point.t, point.x.data(), point.xdot.data(), point.z.data());
  std::vector<double> slopes(model.x.size() + model.z.size());
  gradients_[which](problem_->values().data(), slopes.data());
  double sum = 0;
  for (std::size_t j = 0; j < slopes.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    const double y = k < point.x.size() ? point.x[k] : point.z[k - point.x.size()];
    sum += std::fabs(slopes[j]) * (tolerances_.atol[k] + tolerances_.rtol[k] * std::fabs(y));
  }
  return sum;
}

}  // namespace pendula::integrate
