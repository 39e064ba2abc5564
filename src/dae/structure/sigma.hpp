// Structure of a DAE: which variable appears in which equation, with which order of derivative.
//
// sigma.hpp (here): offsets from the signature, integers only. blocks.hpp: Dulmage–Mendelsohn decomposition.
// signature.hpp: signature, incidence and system Jacobian of a model. balance.hpp: over- and under-determined
// parts, in words. differentiation.hpp: equations differentiated as often as the offsets say.
//
// Structural analysis by the Σ-method: integers only, no symbols.
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

/// The part of the system Jacobian J that decides whether the structural index ν is the index or only
/// a bound for it, at a point where J is regular.
///
/// F_k = 0 with k = ν - 1 contains F_i^(c_i + s) for the rows with c_i + s ≤ k. Let s = 1 if some
/// d_j = 0, else 0: the rows of stage s are R = {i : c_i < max c}. They are linear in x_j^(d_j + s)
/// with the matrix J_R, and so are the rows of the stages after s; as rows of J are independent, later
/// stages can be satisfied for any values of the unknowns of stage s, and do not restrict them. So
/// F_k = 0 determines x_j^(d_j + s) only if the unit vector e_j is in the row space of J_R. The index
/// asks for T = {j : d_j + s = max(1, order of x_j)}; it is ν if one of these is not determined:
/// |T| + rank(J_R without the columns T) > |R|.
struct LowerIndexRows {
  std::vector<int> rows, other_columns;  ///< R; all columns but T
  int asked = 0;                         ///< |T|
  /// With the rank of J in these rows and columns: F_{ν-1} = 0 does not determine
  /// all that the index asks for.
  bool cannot_determine(int rank) const { return asked + rank > static_cast<int>(rows.size()); }
};
/// orders: the highest derivative of every variable that occurs.
LowerIndexRows lower_index_rows(const Offsets& offsets, const std::vector<int>& orders);

/// Requires as many equations as variables. Cost: O(nnz log n) per sweep of the primal-dual method; few
/// sweeps on models, whose orders are small.
Offsets offsets(const Signature& sigma, int variables);

}  // namespace pendula::dae
