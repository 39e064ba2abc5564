// Shared by the monitors of one large block: its numbers at a point, and the message for a lost rank.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dae/singular/large_blocks.hpp"
#include "integrate/event/monitor/monitor.hpp"
#include "integrate/solve/linear_solver.hpp"

namespace pendula::integrate {

/// A size of w, or of |det J|, that counts as 0 beside those at the ends of an interval: bisection in 30
/// halvings reaches 10⁻⁹ of them, interpolation of x inside a step at a tolerance of 10⁻³ errs by as much.
inline constexpr double zero_size = 3e-3;

/// The solution between the last look at a block and now, with x′ and z. Throws Failure.
using SolutionBetween = std::function<void(double t, Point& out)>;

class RankBlock {
 public:
  /// sizes: of the unknowns (x, z), or empty.
  RankBlock(const dae::LargeBlock& block, const ProblemPtr& problem, const Vec& sizes = {});

  const dae::LargeBlock& block() const { return block_; }
  const std::vector<Expr>& arguments() const { return given_->arguments(); }
  /// Whether sizes change what is watched.
  static bool needs_sizes(const dae::LargeBlock& block) { return block.gradients.rows == 1; }
  /// How large each unknown is that a column of the gradients moves, in one unit of time; 1 where it is not known, and
  /// for several rows: a rough size would turn their smallest combination, and a passage through 0 be missed.
  /// Gradients of y in metres and x in micrometres cannot be compared without.
  std::vector<double> units_of_columns() const;
  /// [t, x, x′, z, u, p] at a point; valid until the next call.
  const double* values(const Point& point);

  /// "the equations a, b no longer determine x, y (remedy)", at a point where the block can still be solved.
  std::string equations_lose(const Point& point);
  /// "no longer determine x, y": the unknowns of the direction that the block maps to almost nothing, found
  /// by inverse iteration on JᵀJ.
  std::string loses(const Point& point);
  static std::string remedy();

  /// A point just before t, where the block can be solved.
  static Point just_before(double t, double from, const SolutionBetween& between);
  /// False where the solution has no values.
  static bool reached(double t, const SolutionBetween& between, Point& out);

  static std::vector<Position> positions(const dae::LargeBlock::Matrix& m, bool transposed = false);
  static std::vector<Expr> entries(const dae::LargeBlock::Matrix& m);
  /// The names, six of them at most.
  static std::string some(const std::vector<std::string>& words);
  /// A unit-sized start for inverse iteration that is not orthogonal to a direction by accident: the
  /// directions looked for tend to have equal or alternating entries, this vector has neither.
  static Vec generic_direction(int size);

 private:
  const dae::LargeBlock& block_;
  ProblemPtr given_, own_;  ///< own_: a copy where there are inputs, whose evaluation changes the problem
  std::vector<double> values_;
  Vec sizes_;
};

}  // namespace pendula::integrate
