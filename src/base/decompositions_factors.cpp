#include "base/decompositions_shared.hpp"

namespace Eigen {

PENDULA_TRIANGULAR_FACTORS(template)
PENDULA_ORTHOGONAL_FACTORS(template)
PENDULA_REFLECTIONS(template)

namespace internal {
PENDULA_BLOCK_REFLECTIONS(template)
}

}  // namespace Eigen

namespace pendula {

Mat full_q(const HouseholderProduct& q) { return q; }

Mat thin_q(const HouseholderProduct& q, Eigen::Index columns) { return q * Mat::Identity(q.rows(), columns); }

Vec times_transposed(const HouseholderProduct& q, const Vec& v) { return q.transpose() * v; }

Mat inverse_by_lu(const Mat& A) { return A.inverse(); }

Mat inverse_by_lu(const Eigen::PartialPivLU<Mat>& factors) { return factors.inverse(); }

double determinant_by_lu(const Mat& A) { return A.determinant(); }

Mat pseudo_inverse(const Eigen::CompleteOrthogonalDecomposition<Mat>& factors) {
  return factors.pseudoInverse();
}

}  // namespace pendula
