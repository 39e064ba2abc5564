// Solves the equations for x′ and z at given t and x: right-hand side of explicit methods, values at mesh
// points.
#pragma once

#include "base/error.hpp"
#include "integrate/problem/rhs_layout.hpp"
#include "integrate/solve/linear_solver.hpp"
#include "integrate/solve/stats.hpp"

namespace pendula::integrate {

/// The equations do not determine x′ and z at a point.
class OpenEquations : public Failure {
 public:
  using Failure::Failure;
};

/// The equations have no finite value at a point.
class UndefinedEquations : public Failure {
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
  bool is_linear() const { return ode_ || layout_->linear; }
  bool has_constant_matrix() const { return ode_ || layout_->constant; }
  /// ∂F/∂(x′, z) was well away from singular, in any units of the unknowns, where it was last factorised.
  bool is_regular() const {
    return ode_ || solver_.weakest_pivot() > least_pivot || is_regular_in_other_units();
  }

 private:
  static constexpr double rounding = 1e-14;     ///< 45 ε, of an unknown
  static constexpr double least_pivot = 1e-12;  ///< of its row
  bool is_regular_in_other_units() const;
  bool assemble();
  bool solve(double t, const double* x, double* xdot, double* z, bool near);
  bool newton(double* xdot, double* z, bool near);
  bool approach();
  bool approach_by_exponents();
  double correct(double* xdot, double* z);
  /// State of Newton's iteration, lengths in units of the unknowns, and a forecast of the next correction.
  struct Progress {
    double last = 0;      ///< correction
    double distance = 0;  ///< from where the matrix was made
    double rate = 1;      ///< at which the next correction with this matrix will be shorter
    double expected = std::numeric_limits<double>::infinity();  ///< length of the next one, with this matrix
  };
  void expect(Progress& progress, bool fresh, bool first);
  std::vector<double>& largest_terms();
  bool is_nearly_linear();
  double contraction();
  bool renewal_pays(const Progress& progress) const;
  bool solved_to_rounding();
  ProblemPtr problem_;
  Stats& stats_;
  codegen::Kernel jacobian_;
  std::shared_ptr<const RhsLayout> layout_;  ///< nullptr for explicit ODEs
  std::vector<double> entries_, r_, residual_, changed_, rounding_, values_;
  std::vector<double> before_;   ///< the correction before r_
  std::vector<double> begin_;    ///< x′ and z that a search begins with
  std::vector<double> usual_;    ///< recent size of every unknown
  double relative_change_ = 0;   ///< last correction, longest part of all unknowns in units of each
  double nonlinear_change_ = 0;  ///< the same of those that the matrix depends on
  double curvature_ = 1;         ///< δₖ₊₁/δₖ² of Newton's iteration in the solutions so far
  double accuracy_ = rounding;
  LinearSolver<double> solver_;
  bool ode_, ready_ = false;
  enum class Trouble { none, not_finite, singular, diverged, far } trouble_ = Trouble::none;
  int failed_row_ = 0;
  unsigned version_ = 0;  ///< of the problem, when it was factorised
};

}  // namespace pendula::integrate
