// Structural analysis of a DAE by the Σ-method: integers only, no symbols.
//
// σ_ij is the highest order of derivative of variable j in equation i, or absent. A transversal of greatest
// value assigns an equation to every variable; the smallest dual solution says how often every equation has
// to be differentiated:
//   c_i ≥ 0,  d_j - c_i ≥ σ_ij  with equality on the transversal.
// See Pryce, A simple structural analysis method for DAEs, BIT 41(2), 2001; equivalent to Pantelides (1988)
// where that succeeds. The answer is structural: it holds where the system Jacobian ∂F_i^{(c_i)}/∂x_j^{(d_j)}
// is regular, and that has to be checked. docs/derivations.md#sigma.
#pragma once

#include <vector>

namespace pendula::dae {

struct SignatureEntry {
  int variable;
  int order;
};
/// By equations; variables ascending.
using Signature = std::vector<std::vector<SignatureEntry>>;

struct Offsets {
  std::vector<int> c, d;         ///< per equation, per variable
  std::vector<int> equation_of;  ///< the transversal: per variable
  std::vector<int> unmatched;    ///< equations that cannot be matched: structurally singular if not empty
  int value = 0;  ///< of the transversal: Σ d - Σ c, the structural number of degrees of freedom
  /// max c, plus one if some d is 0.
  int index() const;
};

/// Requires as many equations as variables. Cost: O(nnz log n) per sweep of the primal-dual method; few
/// sweeps on models, whose orders are small.
Offsets offsets(const Signature& sigma, int variables);

}  // namespace pendula::dae
