// Discrete adjoint: the gradient of a number at the end of a run by one sweep backwards,
// whatever the number of parameters.
//
// A step x₁ = x₀ + h Σ bᵢKᵢ with stages 0 = Fᵢ = F(tᵢ, x₀ + h Σⱼ aᵢⱼKⱼ, Kᵢ, Zᵢ, p) takes λ₁ = dJ/dx₁ back to
//
//     λ₀ = λ₁ - Σᵢ (∂Fᵢ/∂x)ᵀ μᵢ,    dJ/dp = -Σᵢ (∂Fᵢ/∂p)ᵀ μᵢ,
//     h Σᵢ aᵢⱼ (∂Fᵢ/∂x)ᵀ μᵢ + (∂Fⱼ/∂x′)ᵀ μⱼ = h bⱼ λ₁,    (∂Fⱼ/∂z)ᵀ μⱼ = 0,
//
// the exact derivative of the step with h held fixed: for fixed steps that of the computed
// numbers themselves, for chosen steps that of the solution within the tolerance. The stages
// are computed anew from the mesh.
//
// see  Hager, Numer. Math. 87, 2000; Sandu, Int. Conf. Comput. Sci. 2006; docs/derivations.md#adjoint
#pragma once

#include "integrate/problem/problem.hpp"
#include "method/tableau.hpp"

namespace pendula::integrate {

/// A step of a finished run.
struct DiscreteStep {
  Point from;
  double to = 0;
  TableauPtr tableau;
  std::vector<double> modes;  ///< of piecewise equations during the step
};

struct AdjointGradient {
  Vec start;       ///< dJ/dx at the beginning, n
  Vec parameters;  ///< dJ/dp through the equations and J itself, in the order asked for
};

/// cost: in leaves of the problem, evaluated at `end`. parameters: leaves of the problem's form.
///
/// requires  index 0 or 1
/// throws    Failure where stages cannot be recomputed or a matrix is singular
/// cost      per step one factorisation of the s(n + m) stage equations, of n + m per stage where A is
///           triangular; independent of the number of parameters
AdjointGradient adjoint_gradient(const ProblemPtr& problem, const std::vector<DiscreteStep>& steps,
                                 const Point& end, Expr cost, const std::vector<Expr>& parameters);

}  // namespace pendula::integrate
