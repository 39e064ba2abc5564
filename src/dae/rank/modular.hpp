// Generic rank without rounding: expressions are evaluated at random points of the field of integers modulo
// 2⁶¹ - 1 (docs/derivations.md#modular-ranks).
//
// A polynomial or rational identity holds at a random point of a large field with probability at most
// degree/2⁶¹ (Schwartz 1980, Zippel 1979): a matrix that has full rank there has full rank at almost every
// real point, and one that is singular at several points is identically singular. Which identities of other
// functions are kept is said in expr/generic/generic.hpp; rank lost through any other is not
// seen here but by the numeric rank (rank.hpp). Of ifelse, abs, min and max one region is taken,
// the other at every second point.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "expr/graph/derivative.hpp"

namespace pendula::dae {

/// An element of GF(2⁶¹ - 1).
using Residue = std::uint64_t;

/// Values of the outputs at the `attempt`-th random point; named constants (π) are random too. Empty if the
/// point hits a pole. Cost: linear in the nodes.
std::vector<Residue> evaluate_modular(std::span<const Expr> outputs, int attempt);

struct ModularRank {
  int rank = 0;
  std::vector<int> dependent_rows;     ///< rows that are combinations of the others
  std::vector<int> dependent_columns;  ///< columns without pivot
};

/// Generic rank of a sparse matrix of expressions: the best of several random points.
/// Cost: sparse elimination, fewest entries first; linear on banded and tree-like patterns.
ModularRank modular_rank(std::span<const Entry> entries, int rows, int columns);

/// The first row that is a combination of those before it: the multipliers with which rows add up to 0, that
/// of the row itself is 1; empty if the rows are independent.
std::map<int, Residue> first_dependency(std::vector<std::map<int, Residue>> rows);

}  // namespace pendula::dae
