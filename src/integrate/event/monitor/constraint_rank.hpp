// Whether the constraints of a block become dependent along a solution.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/event/monitor/rank_block.hpp"
#include "integrate/solve/gram_factor.hpp"

namespace pendula::integrate {

/// The gradients G of the constraints of a block: with the unit vector u that makes w = Gᵀu smallest, w
/// passes 0 and reverses where rows become dependent (‖w‖ is the least singular value there). It cannot do so
/// before G has changed by ‖w‖ (Weyl's inequality): that says when to inspect again, and whether to
/// inspect between two steps. The time is found by bisection on the continuous extension. Columns are divided
/// by √M_jj where M is known, so that what is found does not depend on units.
class ConstraintRank {
 public:
  /// Blocks of at most this many rows are inspected after every step: there Weyl's inequality is sharp enough
  /// to tell a passage from a near miss, and an inspection costs less than the step.
  static constexpr int small = 8;

  /// tolerance: of the run, relative. A constraint defect ε shifts the singular point by √ε; closer than √ε
  /// counts as reached. Requires a block with gradients.
  ConstraintRank(RankBlock& block, double tolerance);

  void start(const Point& point);
  /// `steps` since the last inspection. nearby: where only a reversal is searched; a continuous extension of
  /// high order costs as much as the step.
  std::optional<Stop> inspect(const Point& point, long steps, const SolutionBetween& between,
                              const SolutionBetween& nearby);
  bool is_small() const { return gram_.rows() <= small; }
  /// Of an inspection, in operations.
  double cost() const { return cost_; }
  /// How many steps until w may have changed by half its length, at the rate of the last inspection.
  long steps_to_change() const { return steps_to_change_; }
  /// The same as a time, for small blocks.
  double due() const { return last_.t + pace_; }
  /// "the constraints … are dependent", if they almost are; "" else.
  std::string almost_lost(const Point& point);

 private:
  /// The smallest combination of gradients at a time.
  struct Inspection {
    double t = 0, size = 0;
    Vec u, w;
    std::vector<double> gradients;  ///< of a small block
  };
  void limit_column_lengths(std::vector<double>& units, const Point& point);
  double measure(const Point& p, Vec& u, Vec& w, int iterations);
  double change(const Inspection& from, const Inspection& to) const;
  void keep_gradients(Inspection& out) const;
  void inspect_point(const Point& point, const Inspection& before, Inspection& next);
  std::optional<Stop> approaching_zero(const Inspection& next, const Point& point,
                                       const SolutionBetween& between);
  std::optional<double> extrapolated_zero(const Inspection& next, double rate,
                                          const SolutionBetween& between);
  std::optional<Stop> scan(const Inspection& from, const Inspection& to, int depth,
                           const SolutionBetween& between, const SolutionBetween& nearby);
  double reversal(double low, double high, int halvings, const Inspection& from, Inspection& at,
                  const SolutionBetween& solution);
  std::optional<Stop> bisect(const Inspection& from, const Inspection& to, const SolutionBetween& between,
                             const SolutionBetween& nearby);
  std::string dependent(const Vec& u) const;
  bool is_lost_in_units(double t, double before, const SolutionBetween& between) const;

  static constexpr double forever = std::numeric_limits<double>::infinity();
  RankBlock& block_;
  codegen::Kernel gradients_;
  GramFactor gram_;
  std::vector<double> numbers_, unit_;  ///< unit_: of every entry; empty: as it stands
  Inspection last_, next_;              ///< next_: kept for its storage
  Vec generic_;                         ///< u before anything is known
  double near_;                         ///< of the largest size: closer counts as reached
  double largest_ = 0, first_ = 0;
  Point begin_;            ///< of the run
  double pace_ = forever;  ///< time in which w changes by half its length
  double cost_ = 0;
  long steps_to_change_ = 1;
};

}  // namespace pendula::integrate
