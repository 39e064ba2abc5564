// Numeric rank with the gap of singular values that decided it.
#pragma once

#include <vector>

#include "base/math.hpp"

namespace pendula::dae {

/// Divides the rows of m, then its columns, by their largest entries, and returns these (1 for lines of
/// zeros). A second sweep would divide by 1: after the rows, every entry is at most 1 and every row has a 1;
/// the column of this 1 is not changed, and the others have 1 as their largest entry after the division.
struct LargestEntries {
  Vec rows, columns;
};
LargestEntries divide_by_largest(Mat& m);
/// m after divide_by_largest(): ranks must not depend on units.
Mat equilibrated(Mat m);
/// What rows and columns are multiplied by so that the logarithms of the entries are least in the sense of
/// least squares: the result is the same in any units of rows and columns.
struct Balance {
  Vec rows, columns;
  Mat operator()(const Mat& m) const { return rows.asDiagonal() * m * columns.asDiagonal(); }
};
Balance balance(const Mat& m);
/// The same of a sparse matrix; entries of size 0 do not count. Cost: one sparse factorisation.
struct EntrySize {
  Eigen::Index row, column;
  double size;
};
Balance balance(Eigen::Index rows, Eigen::Index columns, const std::vector<EntrySize>& entries);

struct RankGap {
  int rank = 0;
  double gap = 0;  ///< σ_r / σ_{r+1}, rounding level taken as the least σ; a lower bound where QR proves it
};
constexpr double clear_gap = 1e6;  ///< between singular values that count and those that do not

/// Smaller components of null vectors count as 0. Rounding leaves ε/σ_r in them: 2e-8 at σ_r = 1e-8 σ₁, where
/// rank_with_gap() cuts.
constexpr double visible_in_null_vector = 1e-6;

/// Rank after equilibration of rows and columns, cut at the widest gap of singular values below 1e-8 σ₁: by a
/// QR factorisation with pivoting where its bounds show that gap, by the singular values elsewhere. Cost:
/// O(r c min(r, c)), ten times less where QR is enough.
RankGap rank_with_gap(const Mat& m);

/// The same where every entry is accurate relative to itself, so that small entries are not rounding errors
/// of 0: where the rank is not full, that of the balanced matrix if this is higher and clear. Largest
/// entries of 1 do not make a matrix well scaled: a triangular one of ones, in units that fall from
/// column to column, looks singular.
RankGap rank_in_any_units(const Mat& m);

}  // namespace pendula::dae
