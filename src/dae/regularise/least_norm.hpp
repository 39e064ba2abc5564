// Multipliers of least norm where constraint forces B z are not unique.
//
// z ⊥ ker B means z ∈ range Bᵀ. With r independent columns B_K of B, r its rank,
// that range is the one of Bᵀ B_K:
//     z = Bᵀ B_K y,   y ∈ ℝʳ,
// so that y is determined, and no null vector has to be known. Rows of B in different units, forces and
// torques, are weighted, z = Bᵀ D B_K y, D diagonal: the range is the same, and rounding errors do not grow.
// Constraints that follow from the others are left out of the equations. Their violation is monitored as an
// excess: 0 at every start; a run ends where it grows.
#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "dae/model/make_model.hpp"

namespace pendula::dae {

struct LeastNorm {
  VecX z;
  std::vector<Entry> B;                    ///< ∂(force equations)/∂z
  std::vector<int> columns;                ///< r independent ones of B
  std::vector<double> weights;             ///< D, of the rows of B
  VecX left_out;                           ///< constraints
  std::unordered_map<Expr, double> sizes;  ///< of their coordinates, as ConstraintRank has them
};

/// Weights 100⁻ᵏ of generalised forces along coordinates q with these units; 1 for the largest unit and
/// units down to a thirtieth of it.
std::vector<double> force_weights(const VecX& q, const std::unordered_map<Expr, double>& units);

/// The equations, unknowns, start values and events for it. `note` stands beside z.
void add_least_norm(const LeastNorm& least, const std::string& note,
                    const std::unordered_set<std::string>& used, std::vector<Block>& blocks,
                    ModelOptions& options);

/// The same motion by independent constraints, for a model whose constraints depend on each other at the
/// position near these values and beside it: one made by lagrange, or any with constraints 0 = C(x) between
/// its states and unknowns z that enter the other equations linearly. `dependent` of the result points to it.
/// throws    Error: no constraints; Failure: independent ones, no position, a singular position
ModelPtr independent(const ModelPtr& model, const std::unordered_map<Expr, double>& near);

/// Constraints that depend on each other, and what they restrict.
struct DependentConstraints {
  VecX C, q;
  std::vector<Entry> dCdq;
  std::vector<Entry> M;  ///< what changes of q are measured by: the mass matrix, or squares of inverse units
};
DependentConstraints dependent_constraints(const Model& model);

/// z of a model that has at least two such constraints; else none.
std::vector<Expr> multipliers_of(const Model& model);

/// Why a model that was typed with such constraints has no index: which of them follow from which, and that z
/// is not unique. "" where its constraints are independent or none. Cost: a few searches for positions.
std::string why_forces_are_open(const Model& model);

}  // namespace pendula::dae
