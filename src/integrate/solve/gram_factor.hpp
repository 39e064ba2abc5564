// L D Lᵀ of G Gᵀ for a sparse matrix G of fixed pattern: how dependent the rows of G are.
#pragma once

#include <vector>

#include "base/math.hpp"
#include "integrate/solve/linear_solver.hpp"

namespace pendula::integrate {

/// Everything that depends on the pattern is done once; a factorisation is three loops over lists.
class GramFactor {
 public:
  /// Rows in an order of little fill-in (approximate minimum degree).
  GramFactor(int rows, int columns, const std::vector<Position>& positions);

  /// The same, from the last few that were made.
  static GramFactor remembered(int rows, int columns, const std::vector<Position>& positions);

  /// values in the order of positions. Rows are divided by the sizes they had in the first call. False where
  /// G Gᵀ is singular to rounding: then the solves are of a matrix nearby.
  bool factorise(const double* values);

  /// A few steps of inverse iteration: `u` (unit, rows) comes nearer to the combination of scaled rows that
  /// is smallest, w = Gᵀu is that combination. Returns ‖w‖, an upper bound of the least singular value and
  /// near to it where that is small.
  double least(Vec& u, Vec& w, int iterations) const;
  /// The entries as they were factorised, rows scaled.
  const std::vector<double>& scaled() const { return scaled_; }
  /// The divisor of a row.
  double scale(int row) const { return 1 / scale_[row]; }
  int rows() const { return rows_; }
  int columns() const { return columns_; }
  std::size_t operations() const { return pairs_.size() + 2 * target_.size() + 8 * entry_row_.size(); }

 private:
  struct Pair {
    int a, b, slot;
  };
  void order(const std::vector<Position>& positions);
  void fill(std::vector<std::vector<int>> below);
  int slot(int i, int j) const;
  int rows_, columns_;
  std::vector<Position> positions_;
  std::vector<int> place_;                       ///< of a row in the order of elimination
  std::vector<Pair> pairs_;                      ///< slot += a b
  std::vector<int> start_, entry_row_, target_;  ///< columns of L; diagonal slots are 0 … rows - 1
  std::vector<double> values_, scaled_, scale_;
  mutable std::vector<double> right_;
};

}  // namespace pendula::integrate
