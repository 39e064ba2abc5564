#include "base/triangular_factor.hpp"

#include "base/decompositions.hpp"

namespace pendula {

using Eigen::Index;

void TriangularFactor::add(const Eigen::Ref<const Mat>& block) {
  const Index n = R_.cols();
  Mat stacked(n + block.rows(), n);
  stacked << R_, block;
  const Eigen::HouseholderQR<Eigen::Ref<Mat>> qr(stacked);  // in place
  R_ = stacked.topRows(n).triangularView<Eigen::Upper>();
  rows_ += block.rows();
}

TriangularFactor triangular_factor(const Mat& A, const Vec& b) {
  constexpr Index block = 1024;
  TriangularFactor factor(A.cols() + 1);
  for (Index t = 0; t < A.rows(); t += block) {
    const Index n = std::min(block, A.rows() - t);
    Mat both(n, A.cols() + 1);
    both << A.middleRows(t, n), b.segment(t, n);
    factor.add(both);
  }
  return factor;
}

}  // namespace pendula
