#include "base/decompositions.hpp"

namespace Eigen {

template class JacobiSVD<MatrixXd>;
template class JacobiSVD<MatrixXd, HouseholderQRPreconditioner>;
template class JacobiSVD<MatrixXd, FullPivHouseholderQRPreconditioner>;
template class JacobiSVD<MatrixXcd>;
template class BDCSVD<MatrixXd>;

}  // namespace Eigen
