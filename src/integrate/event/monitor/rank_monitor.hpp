// The rank of large blocks along a solution: where constraints become dependent, or equations no longer
// determine their unknowns, the run ends.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "integrate/event/monitor/monitor.hpp"
#include "integrate/event/monitor/rank_block.hpp"

namespace pendula::integrate {

/// Every few steps, each block's constraint gradients (constraint_rank.hpp) and its Jacobian
/// (jacobian_sign.hpp), as often as their change demands and as 0.6 % of the time of the steps pays for.
/// Nothing is computed before the first inspection, which is after a few steps.
class RankMonitor : public Monitor {
 public:
  /// tolerance: of the run, relative; 1e-6 at most. interpolation: of the run, null if it has none: then
  /// between two inspections by Hermite interpolation. sizes: of the unknowns, asked where a rank seems to be
  /// lost; null: not known. Requires that blocks and interpolation outlive it.
  RankMonitor(const ProblemPtr& problem, const std::vector<dae::LargeBlock>& blocks, double tolerance,
              const std::function<Vec()>& sizes, StepInterpolation* interpolation = nullptr);
  ~RankMonitor() override;
  bool empty() const { return parts_.empty(); }

  void start(const Point& point) override;
  void restart(const ProblemPtr& problem) override;
  std::optional<Stop> after(const MonitoredStep& step) override {
    const bool due = !parts_.empty() && (--wait_ <= 0 || step.here.t >= due_ || step.last);
    return due ? inspect(step) : std::nullopt;
  }
  /// After a failure: the block that has almost lost its rank at this point; "" if none has.
  std::string almost_lost(const Point& point);

 private:
  struct Part;
  Part& part(std::size_t k);
  std::optional<Stop> inspect(const MonitoredStep& step);
  ProblemPtr problem_;
  const std::vector<dae::LargeBlock>& blocks_;
  std::vector<std::unique_ptr<Part>> parts_;
  double tolerance_;
  std::function<Vec()> sizes_;
  StepInterpolation* interpolation_;
  Point inspected_;                  ///< where the run began, then at the last inspection
  double due_ = 0, operations_ = 0;  ///< operations_: of one evaluation of the equations
  long wait_ = 0, steps_ = 0;
  bool ready_ = false;
};

}  // namespace pendula::integrate
