// x′ and z where t and x are known: what an explicit method evaluates, and what a mesh point is completed by.
#pragma once

#include "base/error.hpp"
#include "integrate/problem/problem.hpp"
#include "integrate/solve/linear_solver.hpp"
#include "integrate/solve/stats.hpp"

namespace pendula::integrate {

/// The equations do not determine x′ and z at a point.
class OpenEquations : public Failure {
 public:
  using Failure::Failure;
};

/// Solves F(t, x, x′, z) = 0 for (x′, z). An explicit ODE is one evaluation of f. Equations that are linear
/// in (x′, z) take one factorisation of ∂F/∂(x′, z), one in all where that is constant; others Newton's
/// iteration from the values given, with the factorisation kept while it contracts.
///
/// requires  index 0 or 1 in these unknowns: ∂F/∂(x′, z) regular
class RhsSolver {
 public:
  RhsSolver(ProblemPtr problem, Stats& stats);

  /// xdot (n) and z (m) in: starting values, out: the solution on their branch. False where F is not finite,
  /// the matrix is singular, the iteration fails, or where it contracts so slowly from the values given that
  /// it might end on another branch (Deuflhard, Newton Methods for Nonlinear Problems, 2004, §5.1.1: Θ ≤ 1/2
  /// in every step); reason() says why. No allocation.
  bool operator()(double t, const double* x, double* xdot, double* z);
  /// The same for a stage of a step: x′ and z to this relative accuracy, or to rounding where that is more.
  bool stage(double t, const double* x, double* xdot, double* z, double accuracy);
  /// The same from values that may be far away; throws OpenEquations or another Failure.
  void require(double t, const double* x, double* xdot, double* z);
  /// x′ and z of a point, from t and x and the values there. False, and the point unchanged, where the
  /// equations leave them open; throws Failure where they have no solution.
  bool settle(Point& point);
  std::string reason() const;
  bool is_linear() const { return linear_; }
  bool has_constant_matrix() const { return constant_; }
  bool is_singular() const { return trouble_ == Trouble::singular || !is_regular(); }
  /// ∂F/∂(x′, z) was well away from singular, in any units of the unknowns, where it was last factorised.
  bool is_regular() const {
    return ode_ || solver_.weakest_pivot() > least_pivot || is_regular_in_other_units();
  }

 private:
  /// Of ∂F/∂(x′, z).
  struct Layout {
    std::vector<Position> positions;
    codegen::Kernel values;
    std::vector<double> curved;  ///< by unknown: 1 where the matrix depends on it, else 0
    /// By unknown: 1 where it may have several values while the unknowns of the blocks before its own have one.
    std::vector<double> ambiguous;
    bool linear = true, constant = true;
  };
  static constexpr double rounding = 1e-14;
  static constexpr double least_pivot = 1e-12;  ///< of its row
  bool is_regular_in_other_units() const;
  static Layout layout_of(const Problem& problem);
  bool assemble();
  bool solve(double t, const double* x, double* xdot, double* z, bool near);
  bool newton(double* xdot, double* z, bool near);
  bool approach();
  double correct(double* xdot, double* z);
  /// Newton's iteration as it goes, lengths in units of the unknowns: what the next corrections will be.
  struct Progress {
    double last = 0;      ///< correction
    double distance = 0;  ///< from where the matrix was made
    double rate = 1;      ///< at which the next correction with this matrix will be shorter
    double expected = std::numeric_limits<double>::infinity();  ///< length of the next one, with this matrix
  };
  void expect(Progress& progress, bool fresh, bool first);
  double contraction();
  bool renewal_pays(const Progress& progress) const;
  bool solved_to_rounding();
  ProblemPtr problem_;
  Stats& stats_;
  codegen::Kernel jacobian_;
  std::vector<Position> positions_;  ///< of entries_
  std::vector<double> entries_, r_, changed_, rounding_, values_;
  std::vector<double> before_;              ///< the correction before r_
  std::vector<double> begin_;               ///< x′ and z that a search begins with
  std::vector<double> curved_, ambiguous_;  ///< as in Layout
  std::vector<double> usual_;               ///< size of every unknown, of late
  double moved_ = 0;         ///< last correction, longest part of all unknowns in units of each
  double moved_curved_ = 0;  ///< the same of those that the matrix depends on
  double curvature_ = 1;     ///< δₖ₊₁/δₖ² of Newton's iteration in the solutions so far
  double accuracy_ = rounding;
  LinearSolver<double> solver_;
  bool ode_, linear_ = true, constant_ = true, ready_ = false;
  enum class Trouble { none, not_finite, singular, diverged, far } trouble_ = Trouble::none;
  int culprit_ = 0;
  unsigned version_ = 0;  ///< of the problem, when it was factorised
};

}  // namespace pendula::integrate
