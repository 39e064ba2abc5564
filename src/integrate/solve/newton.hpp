// Newton's method for r(w) = 0 with the exact Jacobian, as the stage equations need it.
//
//   w ← w + λ Δw,   (∂r/∂w) Δw = -r
//
// Converged means: every residual is at the rounding level of its own terms, |rᵢ| ≤ 32 ε (Σⱼ |∂rᵢ/∂wⱼ
// wⱼ| + sizeᵢ), or the next correction would not change w, or residual or correction no longer fall
// although they are below 10⁻¹⁰ of the terms or of w, or corrections no longer fall and are as short as
// those that rounding of the terms leads to. λ < 1 only when the full step fails the natural monotonicity
// test (Deuflhard, Newton Methods for Nonlinear Problems, §3.3.1): the simplified correction from the new
// point must be shorter than Δw.
#pragma once

#include <vector>
#include "base/decompositions.hpp"

#include "base/math.hpp"

namespace pendula::integrate {

/// The equations and their Jacobian. Evaluations may yield NaN or inf; the iteration deals with it.
class Equations {
 public:
  virtual ~Equations() = default;
  virtual void residual(const Vec& w, Vec& r) = 0;
  /// J = ∂r/∂w and size[i] = Σ |terms of rᵢ that do not depend on w|. Both have their final shape already.
  virtual void jacobian(const Vec& w, Mat& J, Vec& size) = 0;
};

/// LU of a matrix whose rows and columns are first scaled to largest entries of 1, so that "singular" does
/// not depend on units.
class ScaledLU {
 public:
  /// False if the matrix is singular to rounding or not finite.
  bool factorise(const Mat& J);
  void solve(const Vec& r, Vec& x);

  /// The directions the scaled matrix does not see, largest component 1: J·right = 0 and leftᵀ·J = 0.
  /// Meant for messages after factorise() returned false.
  static void null_vectors(const Mat& J, Vec& right, Vec& left);

 private:
  bool factorise_small();
  Vec row_, column_, scaled_;
  Mat matrix_;              ///< small: scaled, then its factors with 1/uₖₖ on the diagonal
  std::vector<int> pivot_;  ///< small: the row that changed places with row k
  Eigen::PartialPivLU<Mat> lu_;
};

enum class Outcome { converged, singular, diverged, not_finite };

struct NewtonResult {
  Outcome outcome = Outcome::converged;
  int iterations = 0;
  int factorisations = 0;
  double residual = 0;  ///< max |rᵢ|
  int worst = 0;        ///< the equation with the largest |rᵢ| relative to its terms
  bool ok() const { return outcome == Outcome::converged; }
};

/// Keeps its work arrays between solves of equal size: no allocation.
class Newton {
 public:
  /// Solves from w; on success w is the solution, else the best point found.
  NewtonResult solve(Equations& equations, Vec& w);
  const Mat& last_jacobian() const { return J_; }

 private:
  enum class Trial { accepted, settled, failed };
  double measure(const Vec& w);
  double length(const Vec& step, const Vec& w) const;
  Trial search(Equations& equations, Vec& w);
  bool is_rounding(const Vec& w);

  Mat J_;
  Vec r_, size_, terms_, step_, trial_, trial_r_, simplified_;
  ScaledLU lu_;
  int worst_ = 0;
};

}  // namespace pendula::integrate
