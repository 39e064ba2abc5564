// QR factorisation of tall matrices that arrive block by block.
#pragma once

#include "base/math.hpp"

namespace pendula {

/// The triangular factor R of a tall matrix A: RᵀR = AᵀA, by QR of [R; block] (Golub & Van Loan, Matrix
/// Computations, 4th ed., §5.2). Memory O(columns²), cost 2 rows columns².
class TriangularFactor {
 public:
  /// Rows of a block for add() where the columns are fewer. The rows of R are factored again with each block,
  /// which adds columns/256 to the work; 256 rows of 100 columns are 200 KB and fit into the cache.
  static constexpr Eigen::Index block_rows = 256;
  explicit TriangularFactor(Eigen::Index columns) : R_(Mat::Zero(columns, columns)) {}
  void add(const Eigen::Ref<const Mat>& block);
  const Mat& R() const { return R_; }
  Eigen::Index rows() const { return rows_; }

 private:
  Mat R_;
  Eigen::Index rows_ = 0;
};

/// The factor of [A b], in blocks that fit into the cache.    requires  |b| = rows of A
TriangularFactor triangular_factor(const Mat& A, const Vec& b);

}  // namespace pendula
