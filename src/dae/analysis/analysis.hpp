// Structural analysis of a model, and whether its answer holds.
//
// analysis.hpp (here): Σ-method, system Jacobian and its rank, generically, at the parameter values, and on
// the solutions. determinant_factors.hpp: the factors of det J, where the answer fails. classification.hpp:
// the same in words for models with unspecified functions. The analysis says what the structure says and how
// its Jacobian stands; the index as far as it is known at all is in index/differentiation_index.hpp.
#pragma once

#include <optional>

#include "dae/model/model.hpp"
#include "dae/points/consistent_point_rank.hpp"
#include "dae/rank/modular.hpp"
#include "dae/structure/blocks.hpp"
#include "dae/structure/sigma.hpp"

namespace pendula::dae {

/// Verdict of the system Jacobian J on the structural answer.
enum class JacobianStatus {
  regular,       ///< full rank: the structural answer is valid
  at_values,     ///< full rank for almost all parameter values, but not for those of this model
  on_solutions,  ///< full rank in general, but at no point found that satisfies the equations
  identically,   ///< never full rank
  unmatched      ///< there is no transversal, hence no J
};

struct Analysis {
  Signature sigma;              ///< σ_ij
  Offsets offsets;              ///< c, d and the transversal; empty transversal: structurally singular
  std::vector<Entry> jacobian;  ///< system Jacobian, by rows
  ModularRank rank;             ///< its generic rank, with the rows and columns that are dependent
  JacobianStatus jacobian_status = JacobianStatus::unmatched;
  bool regular = false;  ///< jacobian_status == JacobianStatus::regular
  std::optional<ConsistentPointRanks>
      solutions;  ///< ranks of J where the equations hold, where that was looked at
  int index = 0;  ///< differentiation index where regular
  int dof = 0;    ///< free initial values where regular
};

/// Σ-method, then the rank of the system Jacobian J_ij = ∂F_i/∂x_j^(d_j - c_i): exactly modulo a large prime
/// for all values of its symbols, then for the parameter values of the model; up to 64 equations numerically
/// at random points; up to 60 equations, where J contains unknowns, at points that satisfy the equations
/// (not for reduced forms, which are regular by construction). Throws Error unless there are as many
/// equations as unknowns. Cost: near linear on sparse models; the points on solutions are remembered.
Analysis analyse(const Model& model);

/// The same, but throws a Failure that says why unless the analysis is regular.
Analysis require_regular(const Model& model);

/// Conditions on the start of a model whose analysis is regular: its invariants, then F_i^(k), k < c_i
/// (`differentiate`). Remembered. Cost: derivatives are formed and simplified, index 11 means the tenth.
std::vector<Constraint> hidden_constraints_by_offsets(const Model& model, const Analysis& analysis);

/// Thrown by `require_regular`, and by index() and dof() where no method finds the index.
std::string why_not_regular(const Model& model, const Analysis& analysis);

}  // namespace pendula::dae
