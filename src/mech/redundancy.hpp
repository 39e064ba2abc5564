// Constraints that follow from others wherever the coordinates are: C₃ = C₁ + 2 C₂, one constraint written twice.
//
// With λᵀC = 0 for a λ free of q, λᵀ∂C/∂q = 0: constraint forces (∂C/∂q)ᵀz do not change along λ, and z is not unique.
// The multipliers of least norm are orthogonal to all such λ. Constraints that depend on each other only where they
// hold (a parallelogram with a third crank) are another matter: sys:independent, stdlib/redundant.lua.
#pragma once

#include <string>
#include <vector>

#include "expr/graph/derivative.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::mech {

struct Redundancy {
  std::vector<int> kept;           ///< constraints that imply all others
  std::vector<VecX> combination;   ///< λ, one for each of the others: Σ λ_k C_k = 0
  std::vector<std::string> words;  ///< "C₃ follows from C₁, C₂"
};

/// Throws Error where a constraint contradicts others, C₂ = C₁ + 1, or where its gradient depends on theirs with
/// coefficients that contain coordinates, C₂ = sin(C₁).
Redundancy redundancy(const VecX& C, const VecX& q, const std::vector<Entry>& dCdq);

}  // namespace pendula::mech
