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
  /// sizes: of the unknowns (x, z); null: not known.
  RankBlock(const dae::LargeBlock& block, const ProblemPtr& problem, std::function<Vec()> sizes = {});

  const dae::LargeBlock& block() const { return block_; }
  const std::vector<Expr>& arguments() const { return given_->arguments(); }
  /// M_jj^(-1/2) for each column of the gradients, at a point: in these units their lengths do not depend on
  /// those of the unknowns (G M⁻¹ Gᵀ is what must be regular). Empty where M is not known or an entry is 0.
  std::vector<double> units_by_inertia(const Point& point);
  /// Rough sizes of the unknowns that belong to the columns of the gradients, for one unit of time.
  /// Empty where they are not known.
  std::vector<double> units_by_size() const;
  /// [t, x, x′, z, u, p] at a point; valid until the next call.
  const double* values(const Point& point);
  void take_parameters(const Problem& problem);

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
  std::function<Vec()> sizes_;
};

}  // namespace pendula::integrate
