// Where the structural answer holds: the factors of the determinant of the system Jacobian.
//
// Offsets, degrees of freedom and the bound on the index are right where the system Jacobian J is regular
// (Pryce 2001, Thm 4.2). det J is the product of the determinants of its blocks; what remains of it after
// constants, exponentials and sums of squares have been left out must not vanish:
// docs/derivations.md#validity.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dae/analysis/analysis.hpp"

namespace pendula::dae {

/// A factor of det J.
struct DeterminantFactor {
  Expr factor;  ///< must not vanish
  enum class Kind {
    parameters,
    functions,
    state
  } kind;                          ///< what it consists of: parameters; unspecified
                                   ///< functions (and what is in them); t, unknowns
  std::vector<int> rows, columns;  ///< of the first block with this factor: what it no longer determines
  std::optional<bool> reached;  ///< state: are there consistent points where it vanishes? Not decided: empty
};

struct DeterminantFactors {
  std::vector<DeterminantFactor> conditions;  ///< parameters first
  bool complete = true;                       ///< det J was short enough to be written out
};

/// Requires a model whose J has full generic rank. Blocks of more than four rows, and long determinants, are
/// left out. Cost: linear in the blocks, a few Newton iterations per condition on up to 20 unknowns.
DeterminantFactors determinant_factors(const Model& model, const Analysis& analysis, const Blocks& blocks);

/// Factors of e that may vanish, each once, the way they read best.
std::vector<Expr> vanishing_factors(Expr e);

/// The sign of e for all values of its symbols, as far as the signs of its parts tell: ±2 never 0 (1 + x²),
/// ±1 or 0 (x² + y²), 0 unknown.
int sign_of(Expr e);

/// The blocks of the system Jacobian, each solvable after those before it.
Blocks blocks_of(const Model& model, const Analysis& analysis);

/// "a ≠ 0, x² + y² ≠ 0", of one kind or of all.
std::string conditions_text(const DeterminantFactors& validity,
                            std::optional<DeterminantFactor::Kind> kind = {});

/// Parameters and values for which a factor of parameters alone vanishes: a₅ = a₁; a = b and a = -b of
/// a² - b²; one parameter of each irreducible factor over ℚ, where that is linear or a pure square in it.
std::vector<std::pair<Expr, Expr>> exceptional_values(Expr factor);

}  // namespace pendula::dae
