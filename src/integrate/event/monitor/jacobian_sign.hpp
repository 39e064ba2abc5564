// Whether the Jacobian of a block of equations becomes singular along a solution.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/monitor/rank_block.hpp"

namespace pendula::integrate {

/// The sign of det J of a block. Where an unknown has jumped from one branch of the solution
/// to another within a step, it is the same at both ends and differs in between: a few
/// points between them are looked at.
class JacobianSign {
 public:
  /// Requires a block with a Jacobian.
  explicit JacobianSign(RankBlock& block);
  void start(const Point& point);
  std::optional<Stop> inspect(const Point& point, const SolutionBetween& between);
  /// Of an inspection, in operations.
  double cost() const { return cost_; }
  bool almost_lost(const Point& point);

 private:
  int determinant(const Point& p, double& log);
  std::optional<Stop> bisect(double end, double end_log, const SolutionBetween& between);

  RankBlock& block_;
  codegen::Kernel jacobian_;
  LinearSolver<double> lu_;
  std::vector<double> numbers_;
  int rows_, sign_ = 0;
  double t_ = 0, log_ = 0, first_log_ = 0;  ///< log: of |det J|
  double cost_ = 0;
};

}  // namespace pendula::integrate
