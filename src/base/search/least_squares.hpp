// Minimises a sum of squares, or another smooth function with a positive semidefinite model of its
// curvature, by Gauss–Newton steps in a trust region: the Levenberg–Marquardt method in the form of Moré
// (Numerical Analysis, Dundee 1977, Lecture Notes in Mathematics 630; Nocedal & Wright, Numerical
// Optimization, 2nd ed., §10.3).
//
// At θ the function is V(θ + p) ≈ V + (Rᵀq)ᵀp + ½‖R p‖². A step solves
//     min ½‖R p + q‖²   subject to  ‖D p‖ ≤ Δ,     D = the largest column norms of R so far,
// so that the iterates do not depend on the units of the parameters. Δ shrinks where V falls less than a
// quarter of what the model promises, or where V does not exist, and grows where the promise is kept: near a
// minimum the steps are plain Gauss–Newton steps.
//
// Where the steps do not shrink for long, the curvature that JᵀJ leaves out (Σ r ∇²r) is not small: from then
// on R comes from BFGS updates of the last curvature with the gradients (Fletcher & Xu, IMA J. Numer. Anal.
// 7, 1987), and convergence is superlinear again.
//
// Stopping. A full step promises the decrease P = ½‖q‖². V is known to a relative error `noise` only, so a
// promise P ≤ noise·V cannot be checked by V any more: from there on a step is accepted while the steps
// shrink, and the search has converged when they cease to. √(P/V) is the cosine of the angle between the
// residual and the tangent plane (Bates & Watts, Technometrics 23, 1981): scale-free, 0 at a minimum.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/math.hpp"

namespace pendula {

/// V(θ + p) ≈ value + (Rᵀq)ᵀp + ½‖R p‖², R d×d.
struct QuadraticModel {
  double value = 0;
  Mat R;
  Vec q;
};
/// V = ½‖r‖² with the Jacobian J = ∂r/∂θ: R and q from the QR factorisation of [J r]. Cost 2 rows d².
QuadraticModel gauss_newton_model(const Mat& J, const Vec& r);
/// V with its gradient and Hessian: RᵀR = |H|, the Hessian with its negative eigenvalues reflected, which is
/// a direction of descent where V is not convex.
QuadraticModel newton_model(double value, const Vec& gradient, const Mat& hessian);

/// The model at θ; nothing where V is not defined (a simulation that fails). It may move θ to an admissible
/// point near by (the mirror image of an unstable predictor); the model is then the one at that point.
using SmoothFunction = std::function<std::optional<QuadraticModel>(Vec& theta)>;

constexpr double difference_noise = 1e-12;  ///< for `noise` where R comes from differences
/// For `accuracy` where R comes from central differences, which err by ε^⅔ = 4e-11 of R; 27 times that.
constexpr double difference_accuracy = 1e-9;

struct MinimiserOptions {
  int iterations = 200;
  double noise = 1e-13;     ///< relative error of V: rounding of sums, or the tolerance of an integration
  double accuracy = 1e-11;  ///< relative error of the columns of R: smaller singular values of R D⁻¹ are 0
  /// Ends the search (Ending::known) where it says yes; `scale` is the diagonal of D.
  std::function<bool(const Vec& theta, const Vec& scale)> is_known;
};

enum class Ending {
  converged,   ///< the decrease that is left cannot be told from the errors of V
  boundary,    ///< V falls towards points where it is not defined
  stalled,     ///< V does not fall although its slope is not zero: it is not smooth here
  iterations,  ///< the limit was reached
  known,       ///< is_known said so
};

struct Minimum {
  Vec theta;
  double value = 0;
  int iterations = 0;  ///< accepted steps
  Ending ending = Ending::iterations;
  double angle = 0;            ///< √(P/V): what is left of the slope
  std::vector<double> values;  ///< V at the start and after each accepted step
  bool converged() const { return ending == Ending::converged; }
};
/// How the search ended as a half-sentence for a report, "" where it converged: "stopped after 200 iterations
/// before it converged".
std::string ending_text(const Minimum& m);

/// requires  V defined and finite at `start`. Cost per iteration: one evaluation and an SVD of d×d.
Minimum minimise(const SmoothFunction& V, Vec start, const MinimiserOptions& options);

}  // namespace pendula
