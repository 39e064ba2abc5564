#include "dae/newton/least_step.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/decompositions.hpp"
#include "dae/newton/block_solution.hpp"
#include "dae/newton/sparse_solution.hpp"

namespace pendula::dae {

using Index = Eigen::Index;
using Sparse = Eigen::SparseMatrix<double>;

bool all_finite(const Sparse& J) {
  return std::all_of(J.valuePtr(), J.valuePtr() + J.nonZeros(), [](double v) { return std::isfinite(v); });
}

Vec row_weights(const Sparse& J) {
  Vec weight = Vec::Zero(J.rows());
  for (Index j = 0; j < J.outerSize(); ++j)
    for (Sparse::InnerIterator it(J, j); it; ++it)
      weight[it.row()] = std::max(weight[it.row()], std::fabs(it.value()));
  return weight.unaryExpr([](double largest) { return largest > 0 ? 1 / largest : 1; });
}

Vec least_step(const Sparse& J, const Vec& r) {
  if (J.cols() <= dense_up_to) {
    Eigen::CompleteOrthogonalDecomposition<Mat> qr;
    qr.setThreshold(1e-11);  // relative pivot below which a direction is undetermined
    const Mat A(J);
    qr.compute(A);
    if (qr.rank() < A.cols() && A.rows() >= A.cols()) {
      // Units may be wrong by many orders (currents next to Is = 10⁻¹⁶ A). If the columns scaled to
      // equal length are independent, the step is unique whatever the units. Columns of held unknowns
      // are 0 and never independent.
      const Vec length = A.colwise().norm();
      if (!(length.minCoeff() > 0)) return qr.solve(Vec(-r));
      Eigen::CompleteOrthogonalDecomposition<Mat> scaled;
      scaled.setThreshold(qr.threshold());
      scaled.compute(Mat(A * length.cwiseInverse().asDiagonal()));
      if (scaled.rank() == A.cols()) return Vec(scaled.solve(Vec(-r))).cwiseQuotient(length);
    }
    return qr.solve(Vec(-r));
  }
  if (const auto exact = square_step(J, r)) return *exact;
  return sparse_least_step(J, r);
}

Vec balanced_step(const Sparse& J, const Vec& r) {
  if (J.cols() > dense_up_to) return least_step(J, r);
  Mat A(J);
  std::vector<Index> rows, columns;
  for (Index i = 0; i < A.rows(); ++i)
    if (A.row(i).any()) rows.push_back(i);
  for (Index j = 0; j < A.cols(); ++j)
    if (A.col(j).any()) columns.push_back(j);
  if (rows.empty()) return Vec::Zero(J.cols());
  Vec d = Vec::Zero(J.cols());
  d(columns) = balanced_solution(A(rows, columns), -r(rows));
  return d;
}

}  // namespace pendula::dae
