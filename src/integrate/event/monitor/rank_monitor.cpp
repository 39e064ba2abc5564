#include "integrate/event/monitor/rank_monitor.hpp"

#include <algorithm>
#include <limits>

#include "base/error.hpp"
#include "base/text.hpp"
#include "integrate/event/monitor/constraint_rank.hpp"
#include "integrate/event/monitor/jacobian_sign.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

constexpr double share_of_time = 0.006;  // of the time of the steps, for inspections
constexpr long long_wait = 32;           // steps
constexpr double forever = std::numeric_limits<double>::infinity();

/// One block.
struct RankMonitor::Part {
  Part(const dae::LargeBlock& given, const ProblemPtr& problem, const std::function<Vec()>& sizes,
       double tolerance)
      : block(given, problem, sizes) {
    if (given.gradients.rows > 0) gradients.emplace(block, tolerance);
    if (given.jacobian.rows > 0) jacobian.emplace(block);
  }

  void start(const Point& point) {
    if (gradients) gradients->start(point);
    if (jacobian) jacobian->start(point);
  }

  std::optional<Stop> inspect(const Point& point, long steps, bool last, const SolutionBetween& between,
                              const SolutionBetween& nearby) {
    std::optional<Stop> stop;
    if (gradients) stop = gradients->inspect(point, steps, between, nearby);
    since += steps;
    if (!jacobian || (!last && since < rest)) return stop;
    since = 0;
    const auto other = jacobian->inspect(point, between);
    return other && (!stop || other->t < stop->t) ? other : stop;
  }

  /// Number of steps until the next test, for steps of so many operations.
  long wait(double operations) {
    const auto affordable = [&](double cost) {
      return static_cast<long>(std::min(cost / (share_of_time * operations), 1000.0)) + 1;
    };
    if (jacobian) rest = affordable(jacobian->cost());
    if (!gradients) return jacobian ? rest : long_wait;
    const long least = gradients->is_small() ? 1 : affordable(gradients->cost());
    return std::max(least, std::min(long_wait, gradients->steps_to_change()));
  }

  double due() const { return gradients && gradients->is_small() ? gradients->due() : forever; }

  std::string almost_lost(const Point& point) {
    if (gradients)
      if (const std::string dependent = gradients->almost_lost(point); !dependent.empty())
        return text(". Near there ", dependent, ", and the equations ", block.loses(point));
    if (jacobian && jacobian->almost_lost(point)) return text(". Near there ", block.equations_lose(point));
    return "";
  }

  RankBlock block;
  std::optional<ConstraintRank> gradients;
  std::optional<JacobianSign> jacobian;
  long since = 0, rest = 1;  ///< steps since the last inspection of the Jacobian and until the next one
};

RankMonitor::RankMonitor(const ProblemPtr& problem, const std::vector<dae::LargeBlock>& blocks,
                         double tolerance, const std::function<Vec()>& sizes,
                         StepInterpolation* interpolation)
    : problem_(problem),
      blocks_(blocks),
      parts_(blocks.size()),
      tolerance_(std::min(tolerance, 1e-6)),
      sizes_(sizes),
      interpolation_(interpolation) {}
RankMonitor::~RankMonitor() = default;

void RankMonitor::start(const Point& point) {
  if (parts_.empty()) return;
  inspected_ = point;
  wait_ = ready_ ? 1 : 2;
  steps_ = 0;
  if (ready_)
    for (auto& part : parts_) part->start(point);
}

void RankMonitor::restart(const ProblemPtr& problem) {
  problem_ = problem;
  for (auto& part : parts_)
    if (part) part->block.take_parameters(*problem);
}

RankMonitor::Part& RankMonitor::part(std::size_t k) {
  if (!parts_[k]) {
    parts_[k] = std::make_unique<Part>(blocks_[k], problem_, sizes_, tolerance_);
    parts_[k]->start(inspected_);
  }
  return *parts_[k];
}

std::optional<Stop> RankMonitor::inspect(const MonitoredStep& step) {
  if (!ready_) operations_ = static_cast<double>(problem_->operations());
  ready_ = true;
  const Point& here = step.here;
  const SolutionBetween by_ends = [&](double t, Point& out) {
    hermite(inspected_, here, (t - inspected_.t) / (here.t - inspected_.t), out);
  };
  const SolutionBetween between = [&](double t, Point& out) {
    if (!interpolation_ || !interpolation_->interpolate(t, out)) by_ends(t, out);
  };
  const SolutionBetween nearby = [&](double t, Point& out) {
    if (!interpolation_ || !interpolation_->interpolate_roughly(t, out)) by_ends(t, out);
  };
  const long since = std::max(1L, step.stats.steps - steps_);
  const double evaluations =
      static_cast<double>(step.stats.evaluations) / static_cast<double>(std::max(1L, step.stats.steps));
  steps_ = step.stats.steps;
  wait_ = 1'000'000;
  due_ = forever;
  std::optional<Stop> first;
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    Part& one = part(k);
    const auto stop = one.inspect(here, since, step.last, between, nearby);
    if (stop && (!first || stop->t < first->t)) first = stop;
    wait_ = std::min(wait_, one.wait(std::max(evaluations * operations_, 1.0)));
    due_ = std::min(due_, one.due());
  }
  if (first) first->known = inspected_.t;
  inspected_ = here;
  return first;
}

std::string RankMonitor::almost_lost(const Point& point) {
  for (std::size_t k = 0; k < parts_.size(); ++k)
    if (const std::string found = part(k).almost_lost(point); !found.empty()) return found;
  return "";
}

}  // namespace pendula::integrate
