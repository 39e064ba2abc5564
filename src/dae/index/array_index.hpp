// The derivative array: what a DAE says about x′ when its equations are differentiated, whatever its
// structure (docs/derivations.md#derivative-array).
//
//   F_k(t, x, y) = (F, dF/dt, …, dᵏF/dtᵏ) = 0,   y = (x′, x″, …)
//
// x are the unknowns after lowering to first order: every derivative below the highest one that occurs is an
// unknown of its own, algebraic variables are unknowns whose derivative does not occur in F. The
// differentiation index is the smallest k for which F_k = 0 determines x′ as a function of (t, x): at the
// solutions of F_k = 0 the columns of ∂F_k/∂y that belong to x′ are independent of each other and of all
// other columns ("1-full"), with constant rank. See Campbell, SIAM J. Sci. Stat. Comput. 6(2), 1985;
// Brenan, Campbell & Petzold, Numerical Solution of IVPs in DAEs, 1996, §2.5; Kunkel & Mehrmann,
// Differential-Algebraic Equations, 2006, §3 (their strangeness index is one less where the index is not 0).
//
// The conditions on x are the left null space of ∂F_k/∂y applied to F_k; their number is
// rank ∂F_k/∂(x, y) - rank ∂F_k/∂y, and what they leave free are the degrees of freedom.
//
// Linear systems are decided exactly (modulo a large prime). For nonlinear ones the ranks are those at points
// that satisfy F_k = 0, found by Gauss-Newton from seeded random values, with the gap of the singular values.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

enum class ArrayVerdict {
  determined,    ///< index and dof hold
  varying,       ///< the points disagree: the index depends on the branch or region
  singular,      ///< ∂F_k/∂(x, y) loses rank on the solutions (z³ = y at 0): no index by ranks
  undetermined,  ///< x′ is not determined by any F_k tried: under-determined or dependent equations
  not_covered    ///< too large, or no point that satisfies F_k = 0 was found
};

/// A condition on x that F_k = 0 contains, written out.
struct ArrayCondition {
  Expr residual;     ///< 0 = residual, in x, inputs, parameters and t
  int derivative;    ///< the most often an equation had to be differentiated for it
  std::string from;  ///< "(3) - (1) - (2)", primes for derivatives
};

struct ArrayResult {
  ArrayVerdict verdict = ArrayVerdict::not_covered;
  std::optional<int> index;                 ///< where determined
  std::optional<int> dof;                   ///< free initial values, where determined
  int conditions = 0;                       ///< number of independent conditions on x
  std::vector<ArrayCondition> constraints;  ///< those that are combinations of rows with constant rational
                                            ///< multipliers; complete iff as many as `conditions`
  std::optional<int> generic_index;  ///< for almost all parameter values, where that differs from `index`
  std::optional<int> generic_dof;    ///< the same for dof
  bool exact = false;                ///< decided without rounding
  int points = 0;                    ///< points at which the ranks were taken
  double gap = 0;                    ///< smallest σ_r / σ_{r+1} met; 0 if exact
  std::string text;                  ///< the verdict in words
  std::string covered;               ///< what was done and what was not
};

/// Linear in all unknowns, with coefficients in t, inputs and parameters that residues can decide: the ranks
/// of the derivative array are exact.
bool exactly_linear(const std::vector<Expr>& residuals, const Model& model);

struct ArrayOptions {
  int max_order = 8;      ///< nonlinear systems: F_k with k up to this; linear ones go up to their size
  int max_columns = 420;  ///< of ∂F_k/∂(x, y) for numeric ranks (cost O(n³))
  int max_exact_columns = 6000;
  int points = 3;
  /// Where to look for points first: a seed and values.
  std::vector<std::pair<int, std::unordered_map<Expr, double>>> from = {};
  bool numeric = false;    ///< ranks from singular values for linear systems too
  bool conditions = true;  ///< written out; otherwise only counted
  /// A consistent point (ConsistentState::values): the ranks are taken there too, and a loss of
  /// rank makes the verdict `singular`.
  const std::unordered_map<Expr, double>* at = nullptr;
};

/// Differentiation index, degrees of freedom and conditions of the equations of a model, at its parameter
/// values (parameters without value are taken generic, as are inputs and unspecified functions). A
/// missing index is no exception but a verdict. Cost: dense ranks of at most max_columns columns.
ArrayResult derivative_array(const Model& model, const ArrayOptions& options = {});

}  // namespace pendula::dae
