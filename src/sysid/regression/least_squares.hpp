// Linear least squares min ‖Φθ - y‖² from the triangular factor of [Φ y]: estimate, covariance, rank, and
// which combinations of the parameters the data leave free.
#pragma once

#include <string>
#include <vector>

#include "base/triangular_factor.hpp"

namespace pendula::sysid {

using Eigen::Index;

struct LeastSquares {
  Vec theta;    ///< of minimum norm if the rank is deficient
  Mat inverse;  ///< (ΦᵀΦ)⁻¹, or its pseudo-inverse
  Vec scale;    ///< ‖Φ e_i‖
  Index rank = 0;
  Mat null_space;  ///< d×(d-rank): θ + null_space α predicts the same; reduced echelon form
  double sse = 0;  ///< ‖Φθ - y‖²
  double y_norm = 0;
  Index rows = 0;
  /// The residual is what rounding leaves: ‖Φθ - y‖ ≤ 100 ε (‖y‖ + Σ |θ_i| ‖Φ e_i‖).
  bool exact() const;
  bool identifiable(Index i) const;
};

/// From R of [Φ y] (last column y). The rank is decided on columns scaled to norm 1, at max(rows, d) ε or at
/// the relative accuracy of the columns, if that is worse.
LeastSquares solve_triangular(const Mat& R, Index rows, double accuracy = 0);

/// min (Aθ - y)ᵀ S⁻¹ (Aθ - y) (docs/derivations.md#regression). weights: S = diag(1/w); covariance: S,
/// symmetric positive definite (n×n, or n×1 for its diagonal).
struct Weighting {
  Vec weights;
  Mat covariance;
};
struct WeightedLeastSquares : LeastSquares {
  Mat covariance;     ///< (AᵀS⁻¹A)⁻¹ if S was given, else σ̂²(AᵀA)⁻¹
  double sigma2 = 0;  ///< SSE/(rows - rank); 0 if nothing is left over
  bool known_noise = false;
  Vec residuals;  ///< y - Aθ, not weighted
};
/// throws Error on wrong sizes, NaN, and an S that is not positive definite.
WeightedLeastSquares least_squares(const Mat& A, const Vec& y, const Weighting& weighting);

enum class InParameters { linear, nonlinear };
/// "a is not identifiable", "only a1 + 2 b0 is determined: (a1, b0) + α (2, -1) predicts the same"; one entry
/// per free direction. Where predictions are not linear in θ, the null space is that of their derivatives.
std::vector<std::string> free_directions(const Mat& null_space, const std::vector<std::string>& names,
                                         InParameters predictions = InParameters::linear);

/// √cov_ii; infinite where the parameter is not identifiable.
Vec standard_deviations(const LeastSquares& ls, const Mat& covariance);

}  // namespace pendula::sysid
