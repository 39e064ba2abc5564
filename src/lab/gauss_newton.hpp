// Nonlinear least squares with every iterate kept: min ½‖R(x)‖² by Gauss–Newton.
//
//     (JᵀJ) Δx = -JᵀR,  x ← x + α Δx,   J = ∂R/∂x
//
// The exact Hessian is JᵀJ + S with S = Σ Rᵢ ∇²Rᵢ; Gauss–Newton drops S. Near a minimum the error
// therefore obeys e₊ = (I - α (JᵀJ)⁻¹(JᵀJ + S)) e: convergence is quadratic where S = 0 (zero residuals,
// linear R) and linear with the spectral radius of (JᵀJ)⁻¹S otherwise (Björck, Numerical Methods for Least
// Squares Problems, 1996, §9.2.1). docs/derivations.md#newton.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/numeric_function.hpp"
#include "lab/observed_order.hpp"

namespace pendula::lab {

enum class Damping {
  automatic,    ///< α = 1, ½ … 1/16; where that fails, Levenberg–Marquardt
  fixed,        ///< α as given, no questions asked
  line_search,  ///< α = 1, ½, ¼ …
  marquardt     ///< (JᵀJ + λD²) Δx = -JᵀR with λ adapted in every step
};

/// A predicted rate above it is visible as linear convergence at the end: with six digits per step, two steps
/// do not reach the rounding level.
inline constexpr double linear_in_the_end = 1e-6;

struct GaussNewtonSettings {
  Damping damping = Damping::automatic;
  double alpha = 1;
  double tol = 1e-10;  ///< converged when no component of the Gauss–Newton step is above tol relative to x
  int max = 200;
};

enum class GaussNewtonEnding {
  converged,
  exhausted,  ///< max iterations
  diverged,   ///< ‖x‖ grows beyond all bounds
  stalled,    ///< no step reduces ‖R‖
  undefined   ///< R or J is not finite
};
const char* ending_name(GaussNewtonEnding ending);

struct GaussNewtonRun {
  std::vector<Vec> x;                  ///< x₀ (the start), x₁, …
  std::vector<double> norm, gradient;  ///< ‖R‖ and ‖JᵀR‖ of every iterate
  std::vector<double> alpha, lambda;   ///< of the step from xₖ; λ = 0: a Gauss–Newton step
  GaussNewtonEnding ending = GaussNewtonEnding::exhausted;

  // ── at the last iterate ──
  Vec R;
  Mat J;
  Mat S;  ///< Σ Rᵢ ∇²Rᵢ, empty if not known
  int rank = 0;
  Mat undetermined;         ///< directions that change no residual to first order, one per column (n - rank)
  double variance = 0;      ///< σ² = ‖R‖²/(m - rank); 0 without redundancy (m = rank)
  Mat covariance;           ///< σ²(JᵀJ)⁻¹; empty if J is rank-deficient or m = n
  bool exact_data = false;  ///< ‖R‖ is rounding: σ² means nothing
  std::optional<double> predicted;  ///< spectral radius of I - α (JᵀJ)⁻¹(JᵀJ + S), where known
  double curvature = 0;  ///< smallest eigenvalue of the exact Hessian, scaled by JᵀJ; 0: not known
  Observed observed;
  std::string verdict;

  bool converged() const { return ending == GaussNewtonEnding::converged; }
  int iterations() const { return static_cast<int>(x.size()) - 1; }
};

/// Requires R: ℝⁿ → ℝᵐ and a finite start where R is finite. Deterministic.
/// cost  per iteration one evaluation of R and J, one QR of m × n and, for damped steps, further evaluations
/// of R
GaussNewtonRun gauss_newton(const NumericFunction& R, const GaussNewtonSettings& settings, const Vec& start);

/// The approximation, the table of iterates, parameters ± standard deviation, the verdict.
std::string gauss_newton_text(const NumericFunction& R, const GaussNewtonSettings& settings,
                              const GaussNewtonRun& run);

/// The verdict of a finished run: rate and its reason, or why it did not converge,
/// and what is not determined.
std::string gauss_newton_verdict(const NumericFunction& R, const GaussNewtonRun& run);

/// Directions that the data leave undetermined: "(a, b) can move along (1, -1) …; only a + b is determined".
std::string undetermined_text(const std::vector<std::string>& names, const Mat& directions);

}  // namespace pendula::lab
