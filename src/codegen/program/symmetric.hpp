// Symmetric definite systems as straight-line code: A = L D Lᵀ without pivoting, which is stable for them in
// any order of elimination (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., §10.1), in one
// that keeps L sparse.
//
// The same for A = [M Cᵀ; C D] with a positive definite M and a D ≤ 0: M first, which leaves D - C M⁻¹ Cᵀ,
// negative definite wherever A is regular (docs/derivations.md#closed-loops). M may be singular where A is
// not: then pivots become small relative to the diagonal that they come from, and is_sound() is 0.
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
  std::vector<Slot> reciprocal, pivot;
  std::vector<Slot> diagonal;  ///< what the pivot was in M, or in D - C M⁻¹ Cᵀ
  std::vector<Slot> corner;    ///< the entries of the diagonal of D
  int leading = 0;             ///< steps of M
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
/// M first, M ∈ ℝˡˣˡ with l = leading. Nothing where entries of the diagonal of M are missing, or dense
/// elimination is hardly more work.
std::optional<SymmetricFactor> factor_saddle(int n, int leading, const std::vector<SymmetricEntry>& entries,
                                             const Emit& emit);
/// The solution with one correction of what its last rows leave, C v + D z - g: forces between
/// heavy bodies that pass through a light one cancel in M⁻¹ (f - Cᵀ z), and C v = g would hold to
/// rounding of these forces only.
std::vector<Slot> solve_saddle(const SymmetricFactor& factor, const std::vector<SymmetricEntry>& entries,
                               const std::vector<Slot>& b, const Emit& emit);
/// 1 where no entry on the diagonal of D is positive, every pivot of M is positive, every one of D - C M⁻¹ Cᵀ
/// negative, and more than `smallest_pivot` of the diagonal that it comes from; else 0, also where one is not
/// a number. Emits comparisons and products.
Slot is_sound(const SymmetricFactor& factor, Slot zero, Slot smallest_pivot, const Emit& emit);
/// Errors of M⁻¹ grow with the reciprocal: 10⁴ ε is far below every tolerance.
/// Scaling of unknowns changes nothing.
constexpr double smallest_pivot = 1e-4;
/// The values of x with A x = b.
std::vector<Slot> solve_symmetric(const SymmetricFactor& factor, const std::vector<Slot>& b,
                                  const Emit& emit);

}  // namespace pendula::codegen
