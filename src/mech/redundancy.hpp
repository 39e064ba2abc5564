// Constraints that follow from others: C₃ = C₁ + 2 C₂, one constraint written twice, a sphere and a plane
// beside their circle, a parallelogram with a third crank.
//
// With λᵀ∂C/∂q = 0, constraint forces (∂C/∂q)ᵀz do not change along λ, and z is not unique. The multipliers
// of least norm are orthogonal to all such λ. λ is known in symbols where a constraint is a combination of
// others with polynomials in q as factors: then λᵀC = 0 for all q, and λᵀ∂C/∂q = 0 where C = 0. Otherwise the
// dependence is one of numbers at positions that satisfy all constraints (dae/points/implied_constraints),
// and dae/regularise/least_norm needs no λ.
#pragma once

#include <string>
#include <vector>

#include "base/math.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::mech {

struct Redundancy {
  std::vector<int> kept;          ///< constraints that imply all others
  std::vector<VecX> combination;  ///< λ of those that are combinations of others: Σ λ_k C_k = 0
  std::vector<int> rest;          ///< those that follow from the kept ones where all hold, without such a λ
  std::unordered_map<Expr, double>
      sizes;  ///< of the coordinates at a position, as dae::ConstraintRank has them
  std::unordered_map<Expr, double> units;  ///< of the coordinates, as dae::ConstraintRank has them
  std::vector<std::string> follows, proofs;  ///< of those with λ: "C₃ follows from C₁, C₂", "C₃ = C₁ + 2 C₂"
  std::string ranks;  ///< of those without: "gradients of C₁ … C₄: rank 3 where they hold"
};

/// Throws Error where a constraint contradicts others, C₂ = C₁ + 1. Cost: a few searches for positions; at
/// once where gradients are independent at the first one.
Redundancy redundancy(const VecX& C, const VecX& q, const std::vector<Entry>& dCdq);

}  // namespace pendula::mech
