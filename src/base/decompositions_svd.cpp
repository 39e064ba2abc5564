#include "base/decompositions_shared.hpp"

namespace Eigen {

template class JacobiSVD<MatrixXd>;
template class BDCSVD<MatrixXd>;

}  // namespace Eigen
