// Projection of a state onto the constraints of a form "project".
#pragma once

#include <vector>

#include "base/math.hpp"
#include "codegen/kernel/kernel.hpp"
#include "dae/model/model.hpp"
#include "integrate/solve/linear_solver.hpp"

namespace pendula::integrate {

/// One stage: the least change of some states, in the norm √(dxᵀ W dx), with G(t, x) = 0.
/// See Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.2, "projection methods".
class Projector {
 public:
  /// states: the x of the problem; arguments: what every kernel of the problem takes. Throws Error where a
  /// condition contains a leaf that is not among the arguments.
  Projector(const dae::Projection& stage, std::span<const Expr> states, std::span<const Expr> arguments);
  Projector(const Projector& other);

  /// Newton's method on [W Jᵀ; J 0] [dx; λ] = [0; -G] until dx is rounding. `values`: the arguments, of which
  /// the states (from position first_state on) are moved. Throws Failure if it does not converge.
  void run(std::vector<double>& values, std::size_t first_state);

  /// |Gᵢ| ≤ share · Σⱼ |∂Gᵢ/∂xⱼ| (atolⱼ + rtolⱼ |xⱼ|), with ∂G/∂x of the last run(). Cost: one evaluation of
  /// G.
  bool holds(const std::vector<double>& values, std::size_t first_state, const Vec& rtol, const Vec& atol,
             double share);

 private:
  bool correct(std::vector<double>& values, std::size_t first_state, double& moved, double& largest);
  void prepare();                  ///< on first use: most copies never project
  std::string conditions() const;  ///< for messages
  dae::Projection stage_;
  std::vector<std::size_t> moved_;            ///< positions in the states
  std::vector<Position> jacobian_, weights_;  ///< of the nonzero entries of ∂G/∂x and W
  std::size_t residuals_;
  codegen::Kernel kernel_, residual_kernel_;  ///< G, entries of J and W; G alone
  LinearSolver<double> solver_;
  std::vector<double> numbers_, matrix_, right_, conditions_now_;
  std::vector<double> last_jacobian_;  ///< empty: never projected
};

}  // namespace pendula::integrate
