// Lagrange's equations: kinetic and potential energy and constraints become a DAE of index 3 (or an ODE).
#pragma once

#include <vector>

#include "dae/model/model.hpp"

namespace pendula::mech {

struct Lagrangian {
  VecX q;  ///< generalised coordinates: variables
  Expr T;  ///< kinetic energy, a function of q, q′, t
  Expr V;  ///< potential energy
  VecX C;  ///< constraints C(q, t) = 0, may be empty
  VecX Q;  ///< generalised forces, empty: none
  std::vector<std::pair<VecX, VecX>> forces =
      {};  ///< points and forces that Q was made of, where that is known
  std::string multipliers = "z";
  std::string name;
};

/// d/dt ∂L/∂q′ - ∂L/∂q = Q with L = T - V - zᵀC, as W(q) q″ + (∂C/∂q)ᵀ z = rhs, 0 = C(q).
///
/// shapes    q ∈ ℝⁿ, C ∈ ℝᵐ, Q ∈ ℝⁿ; W = ∂²T/∂q′² ∈ ℝⁿˣⁿ
/// requires  W regular on ker ∂C/∂q and ∂C/∂q of full rank, both generically; W itself may be singular
/// throws    Error: q not made of variables, T without velocities, a constraint without coordinates or
///           redundant, wrong sizes, a mass matrix singular on ker ∂C/∂q (names the coordinates)
/// see       docs/derivations.md#lagrange; Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1 (1.46)
dae::ModelPtr lagrange(const Lagrangian& system);

/// q′, or the derivative of that order, of a column of variables.
VecX dot(const VecX& q, int order = 1);

/// Virtual work: Q = Σ (∂p/∂q)ᵀ F over pairs of a point p(q) and a force F at that point
/// (docs/derivations.md#virtual-work).
/// shapes    p and F of equal size; result ∈ ℝⁿ
VecX generalized_force(const VecX& q, const std::vector<std::pair<VecX, VecX>>& forces);

/// [M (∂C/∂q)ᵀ; ∂C/∂q 0] [q″; z] = c, or M q″ = rhs without constraints.
struct MatrixForm {
  MatX A;
  VecX unknowns;
  VecX c;
};
MatrixForm matrix_form(const dae::Mechanics& mechanics);

/// The three blocks side by side: A · unknowns = c, aligned row by row.
std::string describe(const MatrixForm& form);

}  // namespace pendula::mech
