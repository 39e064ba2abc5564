// Generic rank without rounding: expressions are evaluated at random points of the field of integers modulo
// 2⁶¹ - 1.
//
// A polynomial or rational identity holds at a random point of a large field with probability at most
// degree/2⁶¹ (Schwartz 1980, Zippel 1979): a matrix that has full rank there has full rank at almost every
// real point, and one that is singular at several points is identically singular. sin and cos of one argument
// (and sinh, cosh; square roots) keep their algebraic relations; other functions are independent random
// values of their argument, so that rank lost only through a transcendental identity is not seen here but by
// the numeric rank (rank.hpp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "expr/derivative.hpp"

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

}  // namespace pendula::dae
