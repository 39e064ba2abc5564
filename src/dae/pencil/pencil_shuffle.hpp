// The shuffle algorithm: index reduction of E x′ = A x + g by combining and
// differentiating equations, as on paper.
//
// Rows of E that depend on earlier ones are eliminated; what is left of them, 0 = a x + g, are constraints,
// which are differentiated and take the places of the rows they came from. When E has become regular, the
// number of rounds is the index and the constraints found on the way are all there are. See Luenberger,
// Time-invariant descriptor systems, Automatica 14(5), 1978. docs/derivations.md#shuffle.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "dae/pencil/pencil.hpp"

namespace pendula::dae {

/// "2 (c) - (a)": an equation and its factor in a combination.
struct Multiple {
  mpq_class factor;
  std::string name;
};

struct ShuffleStep {
  enum class Kind { given, combination, differentiation, solved } kind;
  int round;
  std::vector<Multiple> of;  ///< newest first
  std::string name;          ///< of the result: "(d)"
  Expr lhs, rhs;
};

/// Σ q (equation i of the form)⁽ᵏ⁾, by {k, i}.
using Combination = std::map<std::pair<int, int>, mpq_class>;

/// 0 = a x + g
struct ShuffleConstraint {
  RationalMatrix a;  ///< one row
  Expr g;
  int row;         ///< of the form it descends from
  int derivative;  ///< how often that was differentiated
  Combination of;  ///< the equations that it is made of
};

struct Shuffle {
  bool regular =
      true;  ///< false: a row vanished on both sides, the pencil is singular; the rest is incomplete
  std::vector<ShuffleStep> steps;
  std::vector<ShuffleConstraint> constraints;
  std::vector<int> ranks;         ///< of E before round 1, 2, …, and at the end
  std::vector<int> differential;  ///< columns of x that the semi-explicit form keeps as states
  std::vector<std::pair<Expr, Expr>> explicit_form;  ///< x_j′ = right side, then 0 = constraint
  int rounds() const { return static_cast<int>(ranks.size()) - 1; }
};

/// sum + factor · other, terms that cancel left out.
void add_multiple(Combination& sum, const mpq_class& factor, const Combination& other);

/// What a shuffle is made for.
enum class ShuffleScope {
  constraints,  ///< with the ranks; the steps and the semi-explicit form stay empty
  derivation
};

/// Cost: an elimination of E, of n³ rational numbers, in each round in which E is singular; the rows stay as
/// sparse as the system is. The semi-explicit form takes an inverse of E.
Shuffle shuffle(const LinearForm& form, ShuffleScope scope);

/// The derivation, step by step, as one writes it by hand. Requires s.regular.
std::string describe(const Shuffle& s, const LinearForm& form);

}  // namespace pendula::dae
