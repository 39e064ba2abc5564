// Dulmage–Mendelsohn decomposition of a pattern: what is over-determined, what is under-determined, and in
// which order the rest can be solved block by block. Integers only.
//
// See Pothen & Fan, Computing the block triangular form of a sparse matrix, ACM TOMS 16(4), 1990.
#pragma once

#include <vector>

namespace pendula::dae {

/// Columns of every row, any order, no duplicates.
using Pattern = std::vector<std::vector<int>>;

struct Part {
  std::vector<int> rows, columns;
};

struct Blocks {
  Part over;                 ///< more rows than columns; reached from rows without partner
  Part under;                ///< more columns than rows; reached from columns without partner
  std::vector<Part> square;  ///< strongly connected blocks, each solvable after those before it
  std::vector<int> row_of;   ///< maximum matching: row of each column, or -1
};

/// Cost: O(√n · nnz) in practice near linear; no recursion.
Blocks dulmage_mendelsohn(const Pattern& pattern, int columns);

}  // namespace pendula::dae
