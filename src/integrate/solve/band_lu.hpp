// LU factorisation of matrices whose entries lie near the diagonal when rows and columns are well ordered:
// what differential equations on a line, chains and ladders lead to, in whatever order they were written.
//
// Rows are matched with columns (a path that augments a matching: Duff, ACM TOMS 7, 1981), then both are
// numbered along the graph (Cuthill & McKee 1969, from a point far out: Gibbs, Poole & Stockmeyer, SIAM J.
// Numer. Anal. 13, 1976, §2). Elimination pivots rows within the band (Golub & Van Loan, Matrix Computations,
// 4th ed., §4.3.3). docs/derivations.md#direct-solvers.
#pragma once

#include <complex>
#include <memory>
#include <vector>

namespace pendula::integrate {

struct Position {
  int row, column;
};

struct BandOrder {
  std::vector<int> row, column;  ///< the old number of row k, of column k
  int below = 0, above = 0;      ///< how far entries lie from the new diagonal

  /// Nothing where the band is wider than `widest` on a side, or the pattern is structurally singular. The
  /// last answers are remembered. Cost: linear, as a rule.
  static std::shared_ptr<const BandOrder> find(int n, const std::vector<Position>& positions);
  static constexpr int widest = 12;
};

/// Scalar: double or std::complex<double>.
template <class Scalar>
class BandLU {
 public:
  /// positions: an entry may be given in parts (they are added).
  BandLU(const std::vector<Position>& positions, std::shared_ptr<const BandOrder> order);

  /// values in the order of positions. False if the matrix is singular to rounding or not finite. Cost:
  /// O(n · below · (below + above)), no allocation.
  bool factorise(const Scalar* values);
  /// b ← A⁻¹ b.
  void solve(Scalar* b);
  /// The smallest pivot relative to its row.
  double weakest_pivot() const { return weakest_; }
  /// The sign of det A, 0 for complex numbers; log |det A|.
  int determinant(double& log) const;

 private:
  static constexpr std::size_t parts = sizeof(Scalar) / sizeof(double);
  std::shared_ptr<const BandOrder> order_;
  int n_, width_;  ///< width: numbers per row and part, `below` of them left of the diagonal
  std::vector<std::size_t> target_;  ///< of every position
  std::vector<double>
      rows_;  ///< real parts of a row, imaginary parts, the next row; then U, its rows divided by the pivots
  std::vector<double> multipliers_;  ///< below per column; real parts, imaginary parts
  std::vector<double> inverse_;      ///< of the pivots
  std::vector<double> scale_, y_;
  std::vector<int> swap_, last_;  ///< pivot row of step k; the last column of row k
  double weakest_ = 0;
  int reach_ = 0;   ///< of the longest row of U
  int parity_ = 1;  ///< of the orders
  bool odd_ = false;
};

template <>
void BandLU<double>::solve(double* b);
template <>
void BandLU<std::complex<double>>::solve(std::complex<double>* b);
extern template class BandLU<double>;
extern template class BandLU<std::complex<double>>;

}  // namespace pendula::integrate
