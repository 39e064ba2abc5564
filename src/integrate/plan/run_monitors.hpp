// The monitors of a run, in the order in which they are asked.
#pragma once

#include <vector>

#include "integrate/event/monitor/choice_monitor.hpp"
#include "integrate/event/monitor/domain_monitor.hpp"
#include "integrate/event/monitor/rank_monitor.hpp"
#include "integrate/event/monitor/root_branch_monitor.hpp"
#include "integrate/event/monitor/singularity_monitor.hpp"
#include "integrate/event/monitor/tangency_monitor.hpp"
#include "integrate/plan/plan.hpp"

namespace pendula::integrate {

class MonitorList {
 public:
  void start(const Point& point) {
    for (Monitor* monitor : list_) monitor->start(point);
  }
  void restart(const ProblemPtr& problem) {
    for (Monitor* monitor : list_) monitor->restart(problem);
  }
  std::optional<Stop> after(const MonitoredStep& step) {
    for (Monitor* monitor : list_)
      if (auto stop = monitor->after(step)) return stop;
    return {};
  }

 protected:
  void add(Monitor& monitor) { list_.push_back(&monitor); }

 private:
  std::vector<Monitor*> list_;
};

/// Share of its value at the start at which a quantity has almost vanished, for the explanation of a failure.
constexpr double almost_vanished = 0.05;

/// After steps of a fixed length, which have no continuous extension and locate no events.
class FixedStepMonitors : public MonitorList {
 public:
  /// Requires that the plan outlives it.
  FixedStepMonitors(const ProblemPtr& problem, const Plan& plan)
      : divisors_(problem, plan.guards),
        ranks_(problem, plan.blocks, default_rtol, plan.sizes),
        roots_(problem, plan.guards),
        domain_(*problem, plan.guards, Tolerances::uniform(problem->n(), default_rtol, 0),
                plan.is_determined(), plan.check_singularities),
        problem_(problem),
        empty_(plan.guards.empty() && plan.blocks.empty()) {
    if (empty_) return;
    add(divisors_);
    add(ranks_);
    add(roots_);
  }
  void start(const Point& point) {
    MonitorList::start(point);
    domain_.start(point);
  }
  std::optional<Stop> after(const Point& before, const Point& here) {
    if (const auto pole = domain_.after(problem_, before, here); pole && !pole->reason.empty())
      return Stop{before.t, pole->reason, before.t};
    if (empty_) return {};
    const Stats none;
    return MonitorList::after({before, here, true, none});
  }
  /// After a failure: see near_singularity(SingularityMonitor&, …).
  std::string near_singularity(const Point& point) {
    const std::string found =
        empty_ ? "" : integrate::near_singularity(divisors_, ranks_, point, almost_vanished);
    return found.empty() ? domain_.almost_outside(point) : found;
  }

 private:
  SingularityMonitor divisors_;
  RankMonitor ranks_;
  RootBranchMonitor roots_;
  DomainMonitor domain_;
  ProblemPtr problem_;
  bool empty_;
};

/// After steps whose events are located.
class AdaptiveStepMonitors : public MonitorList {
 public:
  /// Requires that all of them outlive it.
  AdaptiveStepMonitors(const ProblemPtr& problem, const Plan& plan, const EventFinder& finder,
                       StepInterpolation& interpolation)
      : ranks_(problem, plan.blocks, plan.tolerances.rtol.minCoeff(), plan.sizes, &interpolation),
        roots_(problem, plan.guards),
        tangencies_(problem, plan.events.list, finder, plan.tolerances, plan.to - plan.from),
        choices_(problem, plan.choices, plan.tolerances) {
    if (!ranks_.empty()) add(ranks_);
    if (!roots_.empty()) add(roots_);
    if (!plan.guards.empty()) add(tangencies_);
    if (!choices_.empty()) add(choices_);
  }

 private:
  RankMonitor ranks_;
  RootBranchMonitor roots_;
  TangencyMonitor tangencies_;
  ChoiceMonitor choices_;
};

}  // namespace pendula::integrate
