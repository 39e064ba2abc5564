// Index analysis: what the structure of a model says, and whether it may be believed.
#pragma once

#include "dae/blocks.hpp"
#include "dae/model.hpp"
#include "dae/modular.hpp"
#include "dae/sigma.hpp"

namespace pendula::dae {

struct Analysis {
  Signature sigma;              ///< σ_ij
  Offsets offsets;              ///< c, d and the transversal; empty transversal: structurally singular
  std::vector<Entry> jacobian;  ///< system Jacobian, by rows
  ModularRank rank;             ///< its generic rank, with the rows and columns that are dependent
  bool regular = false;         ///< full rank: the structural answer is valid
  int index = 0;                ///< differentiation index where regular
  int dof = 0;                  ///< free initial values where regular
  std::vector<Constraint> constraints;  ///< conditions on the start, explicit and hidden
};

/// Σ-method, then the generic rank of the system Jacobian J_ij = ∂F_i/∂x_j^(d_j - c_i), exactly modulo a
/// large prime and, up to 64 equations, numerically at random points. Throws Error unless there are as many
/// equations as unknowns. Cost: near linear on sparse models.
Analysis analyse(const Model& model);

/// The same, but throws a Failure that says why unless the analysis is regular.
Analysis require_regular(const Model& model);

/// σ_ij of every equation.
Signature signature(const Model& model);

/// Who appears where, whatever the order of derivative: the pattern for over- and under-determined parts.
Pattern incidence(const Model& model);

}  // namespace pendula::dae
