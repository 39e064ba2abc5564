// Least squares within bounds on the parameters, with derivatives by differences where none are given.
#pragma once

#include <functional>

#include "base/search/least_squares.hpp"

namespace pendula::sysid {

using Eigen::Index;

/// lower ≤ θ ≤ upper; empty vectors: no bounds. Infinite entries are allowed.
struct Bounds {
  Vec lower, upper;
  bool any() const { return lower.size() > 0; }
  /// The nearest point of the box.
  Vec nearest(const Vec& theta) const;
  /// Parameters that rest on a bound which ½‖r‖² pushes against (gradient Jᵀr): their columns of J become 0,
  /// so that a step keeps them there (projected Gauss–Newton; Nocedal & Wright, 2nd ed., §16.7).
  std::vector<Index> hold(const Vec& theta, Mat& J, const Vec& r) const;
};

using Residuals = std::function<Vec(const Vec& theta)>;

/// ∂r/∂θ by central differences of step ε^(1/3)·max(|θᵢ|, scaleᵢ), one-sided at bounds; error about ε^(2/3).
Mat difference_jacobian(const Residuals& r, const Vec& theta, const Vec& scale, const Bounds& bounds);

struct BoundedMinimum {
  Minimum search;
  Vec residuals;
  Mat J;                      ///< at the minimum, columns of active parameters not zeroed
  std::vector<Index> active;  ///< parameters on a bound
};
/// min ‖r(θ)‖² within the bounds. scale: sizes that matter, one per parameter (empty: 1). Points at which r
/// is not finite or throws a UserFacing error are avoided. accuracy: relative, of the columns of J;
/// directions in which J is smaller are left alone.
/// throws  Error where sizes differ or lower > upper; Failure where r is not finite at the start
BoundedMinimum least_squares_within(const Residuals& r, const Vec& start, const Bounds& bounds,
                                    const Vec& scale, int iterations, double accuracy = difference_accuracy);

/// σ² (JᵀJ)⁻¹ over the parameters that do not rest on a bound (zero rows for those
/// that do), σ² = SSE/(rows - rank).
struct SearchCovariance {
  Mat covariance;
  double sigma2 = 0;
  Index rank = 0;
};
SearchCovariance covariance_of(const BoundedMinimum& m);

}  // namespace pendula::sysid
