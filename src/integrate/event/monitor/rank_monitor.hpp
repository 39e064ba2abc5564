// The rank of large blocks along a solution: where constraints become dependent, or equations no longer
// determine their unknowns, the run ends.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dae/rank/large_blocks.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/stats.hpp"

namespace pendula::integrate {

/// Looks every few steps at
///  - the gradients G of the constraints of a block: with the unit vector u that makes w = Gᵀu smallest, w
///    passes 0 and reverses where rows become dependent (‖w‖ is the least singular value there). It cannot
///    do so before G has changed by ‖w‖ (Weyl): that, and what a look costs beside a step, says when to look
///    again, and whether to look between two steps;
///  - the sign of det J of the block, where G does not decide about it.
/// Found, the time is narrowed down by bisection on the continuous extension. Nothing is computed before the
/// first look, which is after a few steps.
class RankWatch {
 public:
  /// tolerance: of the run, relative. A defect ε of the constraints moves a point of dependent rows so that
  /// it is passed at a distance of √ε, on the branch that ε happens to choose: nearer than that is there.
  RankWatch(const ProblemPtr& problem, const std::vector<dae::LargeBlock>& blocks, double tolerance);
  ~RankWatch();
  RankWatch(RankWatch&&) noexcept;

  bool empty() const { return parts_.empty(); }
  /// The run begins, or jumps, here.
  void start(const Point& point);

  struct Hit {
    double t;
    std::string reason;
  };
  /// The solution between the last look and now; full: with x′ and z.
  using Between = std::function<void(double t, Point& out)>;
  /// After every accepted step. `last`: the run ends here, look in any case.
  std::optional<Hit> after(const Point& point, bool last, const Stats& stats, const Between& between) {
    looked_ = !parts_.empty() && (--wait_ <= 0 || point.t >= due_ || last);
    if (!looked_) return {};
    return look(point, last, stats, between);
  }
  /// The last after() has looked.
  bool just_looked() const { return looked_; }
  /// After a failure: what has almost lost its rank at this point; "" if nothing has.
  std::string almost_lost(const Point& point);

 private:
  class Part;
  std::optional<Hit> look(const Point& point, bool last, const Stats& stats, const Between& between);
  ProblemPtr given_;
  const std::vector<dae::LargeBlock>* blocks_;
  std::vector<std::unique_ptr<Part>> parts_;
  double tolerance_;
  Point first_;
  double due_ = 0, operations_ = 0;  ///< operations_: of one evaluation of the equations
  long wait_ = 0, steps_ = 0, evaluations_ = 0;
  bool ready_ = false, looked_ = false;
};

}  // namespace pendula::integrate
