// The order of elimination of a sparse matrix: which rows and columns are pivots, and where fill appears.
#pragma once

#include <complex>
#include <optional>
#include <vector>

namespace pendula::codegen {

struct Elimination {
  std::vector<int> row, column;  ///< of pivot k
  /// Row of pivot k after elimination, in numbers of pivots: lower[k] < k, upper[k] > k, both ascending.
  std::vector<std::vector<int>> lower, upper;
};

/// A: n×n numbers, rows one after the other, zero where there is no entry; `entry`: the pattern (an entry may
/// be zero by chance). Markowitz' rule among entries of at least `threshold` of the largest of their column,
/// rows scaled to largest entries of 1. Nothing if the matrix is singular to rounding or not finite.
std::optional<Elimination> choose_pivots(int n, std::vector<std::complex<double>> A, std::vector<char> entry,
                                         double threshold = 0.1);

}  // namespace pendula::codegen
