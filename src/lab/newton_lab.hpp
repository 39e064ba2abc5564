// The Newton laboratory: r(x) = 0 with every iterate kept (docs/derivations.md#newton):
//
//     M Δx + r(x) = 0,   x ← x + α Δx,   M = ∂r/∂x, or an approximation of it
//
// Every iterate is kept, the order is measured, and a verdict says why convergence is quadratic, linear
// or absent. The stage solver of the integrators is newton.hpp; this one is for looking.
//
// Local theory used in verdicts (Ortega & Rheinboldt, Iterative Solution of Nonlinear Equations, 1970, §10.1;
// Decker, Keller & Kelley, SIAM J. Numer. Anal. 20(2), 1983 for singular roots): near a root x⋆ with regular
// J = ∂r/∂x the error obeys e₊ = (I - α M⁻¹ J) e + O(‖e‖²). The rate of linear convergence is the spectral
// radius of that matrix: 1 - α for exact Jacobians, 0 for exact full steps, which leaves ‖e₊‖ ≤ c ‖e‖².
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/numeric_function.hpp"
#include "lab/observed_order.hpp"

namespace pendula::lab {

enum class JacobianKind { exact, finite_difference, frozen, given };

struct NewtonSettings {
  double alpha = 1;          ///< 0 < α ≤ 1, the step length; ignored with line_search
  bool line_search = false;  ///< α = 1, ½, ¼, … until ‖r‖ falls by the factor 1 - α/4
  double tol = 1e-12;  ///< converged when ‖r‖₂ ≤ tol or ‖r‖ is at the rounding level of its terms
  JacobianKind jacobian = JacobianKind::exact;
  std::function<void(const Vec&, Mat&)> given;  ///< M(x) for JacobianKind::given
  double difference = 0;                        ///< relative step of finite differences; 0: √ε
  int max = 0;  ///< most iterations; 0: 100, more when damping makes it slow (100/α)
};

enum class Ending {
  converged,
  singular,   ///< M has no inverse at the last iterate
  cycle,      ///< the iterates repeat
  diverged,   ///< ‖x‖ grows beyond all bounds
  undefined,  ///< r or M is not finite
  stuck,      ///< line search: no step along Δx reduces ‖r‖
  vanishing,  ///< ‖r‖ → 0 while x moves on: no root is near
  exhausted   ///< max iterations
};
const char* ending_name(Ending ending);

struct NewtonRun {
  std::vector<Vec> x;         ///< x₀ (the start), x₁, …
  std::vector<double> norm;   ///< ‖r(xₖ)‖₂
  std::vector<double> noise;  ///< the rounding level of ‖r(xₖ)‖
  std::vector<Vec> blur;      ///< what rounding leaves undetermined in each component of xₖ
  std::vector<double> alpha;  ///< of the step from xₖ; one entry fewer
  Ending ending = Ending::exhausted;
  int period = 0;           ///< of a cycle
  Vec null_vector;          ///< of M (singular) or of ∂r/∂x at a singular root
  std::string explanation;  ///< of Ending::undefined: which part of which equation

  // ── filled by judge() ──
  Observed observed;                ///< errors, order and rate where x⋆ is known
  std::optional<double> predicted;  ///< spectral radius of I - α M⁻¹ J at the root, where known
  double condition = 0;             ///< of the scaled ∂r/∂x at the root
  bool singular_root = false;
  std::string verdict;  ///< in words

  bool converged() const { return ending == Ending::converged; }
  int iterations() const { return static_cast<int>(x.size()) - 1; }
};

/// Iterates from `start` until it converges or cannot go on. Requires r: ℝⁿ → ℝⁿ and a finite start.
/// Deterministic; cost per iteration: one evaluation of r and M and one LU of size n. Throws Interrupted.
NewtonRun iterate(const NumericFunction& r, const NewtonSettings& settings, const Vec& start);

/// Measures errors, order and rate, and writes the verdict.
void judge(const NumericFunction& r, const NewtonSettings& settings, NewtonRun& run);

/// The table: iterates to 15 digits, ‖r‖, ‖e₊‖/‖e‖, ‖e₊‖/‖e‖², observed order; then the verdict. Numbers at
/// rounding level are shown as ≈ 0 or left out, so that the text does not depend on the machine.
std::string newton_text(const NumericFunction& r, const NewtonSettings& settings, const NewtonRun& run);

/// Which root does Newton find from where? Two unknowns, a grid of starts.
struct Basins {
  std::vector<Vec> roots;      ///< ordered by the first, then the second unknown
  Eigen::MatrixXi root;        ///< of the start (column, row): 1 … roots.size(), or 0: none
  Eigen::MatrixXi iterations;  ///< taken there
  Vec first, second;           ///< the values of the grid
};
Basins basins(const NumericFunction& r, const NewtonSettings& settings, const Vec& first, const Vec& second);

}  // namespace pendula::lab
