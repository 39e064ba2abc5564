#include "base/decompositions.hpp"

namespace Eigen {

PENDULA_FACTORISATIONS(template)
PENDULA_ORTHOGONAL_SOLUTIONS(template)

}  // namespace Eigen

namespace pendula {

Mat full_q(const HouseholderProduct& q) { return q; }

Mat thin_q(const HouseholderProduct& q, Eigen::Index columns) { return q * Mat::Identity(q.rows(), columns); }

Mat pseudo_inverse(const Eigen::CompleteOrthogonalDecomposition<Mat>& factors) {
  return factors.pseudoInverse();
}

}  // namespace pendula
