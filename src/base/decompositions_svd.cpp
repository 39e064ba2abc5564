#include "base/decompositions.hpp"

namespace Eigen {

template class JacobiSVD<MatrixXd>;
template class JacobiSVD<MatrixXcd>;
template class BDCSVD<MatrixXd>;

}  // namespace Eigen
