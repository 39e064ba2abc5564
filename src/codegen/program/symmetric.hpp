// Symmetric definite systems as straight-line code: A = L D Lᵀ without pivoting, which is stable for them in
// any order of elimination (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., §10.1), in one
// that keeps L sparse.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "codegen/program/program.hpp"

namespace pendula::codegen {

using Emit = std::function<Slot(Op, Slot, Slot)>;

/// Values of a program: lᵢₖ below the pivot of every step, and the reciprocal pivots.
struct SymmetricFactor {
  struct Term {
    int row;
    Slot value;
  };
  std::vector<int> order;                ///< the unknown eliminated in step k
  std::vector<std::vector<Term>> below;  ///< of step k; row: a later step
  std::vector<Slot> reciprocal;
};

struct SymmetricEntry {
  int row, column;
  Slot value;
};

/// An order of the unknowns in which the matrix has few diagonals: step[i] is the new place of unknown i.
struct BandOrder {
  std::vector<int> step;
  int width;  ///< diagonals below the main one
};
/// The given order if it is narrow, else that of Cuthill and McKee (Proc. 24th ACM Conf., 1969); nothing for
/// small matrices, whose elimination is better written out, and where the band would be wide.
std::optional<BandOrder> band_order(int n, std::span<const std::pair<int, int>> places);

/// entries: all of A, or at least its upper triangle. Order:
/// approximate minimum degree. Cost: that of the fill.
SymmetricFactor factor_symmetric(int n, const std::vector<SymmetricEntry>& entries, const Emit& emit);
/// The values of x with A x = b.
std::vector<Slot> solve_symmetric(const SymmetricFactor& factor, const std::vector<Slot>& b,
                                  const Emit& emit);

}  // namespace pendula::codegen
