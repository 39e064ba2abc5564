// What the equations do near the zero of a divisor, on the straight line between two points on both sides of
// it.
//
// Residuals (x′ of an ODE) at distances that shrink by 10⁻³ each time: a pole of order q grows by 10³q, a
// bounded function or a logarithm does not. A bounded function without limit, such as cos(1/x), shows by
// changes that neither fade nor keep their sign. Poles of order below 1, as of 1/√|x|, are integrable, but
// stages near them deceive the error estimate of a step. No solution crosses x = 0 where x′ = -x²/(ε² + x²)
// or x′ = -x, but a step, or an error within the tolerance, can. docs/derivations.md#poles
#pragma once

#include <optional>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

class PoleTest {
 public:
  /// Before the first point x′ and z are kept constant. determined: x′ and z follow from t and x. Requires
  /// that everything outlives it, and that the factor is 0 between the points or at the second.
  PoleTest(const ProblemPtr& equations, bool determined, Expr factor, const Tolerances& tolerances,
           const Point& from, const Point& to);

  /// Do the equations diverge, or oscillate ever faster, towards the zero? Poles that are integrable do not
  /// count where x′ is determined.
  bool is_pole();

  /// Where x′ is determined: the largest error, in tolerances, that a step between the points can make
  /// because of an integrable pole: its area, ∫ K |s - s₀|^(-q) ds = K (s₀^(1-q) + (1 - s₀)^(1-q))/(1 - q),
  /// and what a stage at the nearer end contributes. 0 where there is none.
  double integrable_error();

  /// Where x′ is determined: whether solutions cross the zero, by the rate of change of the factor there and
  /// beside it.
  enum class Crossing {
    possible,
    impossible,  ///< the factor moves towards zero, but is at rest there
    jumped,      ///< so it is, on a part of the step that is too short for its stages
  };
  Crossing crossing();

  /// Do solutions diverge from each other after a zero that is not a pole? If a disturbance grows like δ′ = k
  /// δ/t, k > 0, as for x′ = k x/t, all solutions x = c tᵏ start from one point. If it decays like that
  /// before the zero, all of them meet there. For ODEs only. Returns the time of the zero.
  std::optional<double> parting_time();

 private:
  struct Zero {
    double share;  ///< of the way between the points
    double noise;  ///< rounding error of a distance, as a share
  };
  using Residuals = std::vector<std::vector<double>>;

  std::optional<Zero> zero();
  bool grows(const Zero& zero);
  bool oscillates(const Zero& zero);
  bool oscillates_from(double zero, double distance);
  double hardly(std::size_t i) const;
  double tolerance(std::size_t i) const;
  enum class What { rates, residuals };
  Residuals towards(double zero, double distance, double factor, int count, What what);
  bool rates_here(double* xdot);
  bool is_singular(int direction, double zero, double room, bool fine);
  double growth(double share, int sign);
  double factor_rate(double share);
  double value(double share);
  double value_here();

  Problem& equations_;
  Stats ignored_;
  std::optional<RhsSolver> rhs_;  ///< x′ and z, where they are determined
  const Tolerances& tolerances_;
  codegen::Kernel factor_;
  const Point &from_, &to_;
  Vec offset_;
  Point point_;
};

}  // namespace pendula::integrate
