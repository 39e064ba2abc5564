#include "base/decompositions.hpp"

namespace Eigen {

template class HessenbergDecomposition<MatrixXd>;
template class HessenbergDecomposition<MatrixXcd>;
template class Tridiagonalization<MatrixXd>;
template class RealSchur<MatrixXd>;
template class ComplexSchur<MatrixXd>;
template class ComplexSchur<MatrixXcd>;
template class EigenSolver<MatrixXd>;
template class ComplexEigenSolver<MatrixXd>;
template class ComplexEigenSolver<MatrixXcd>;
template class SelfAdjointEigenSolver<MatrixXd>;

}  // namespace Eigen
