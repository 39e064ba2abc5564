// Eigen's factorisations of dense matrices. Those of double and complex are compiled once, in
// decompositions*.cpp: instantiating them in every file that uses them took half of a build.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace Eigen {

extern template class LLT<MatrixXd>;
extern template class PartialPivLU<MatrixXd>;
extern template class PartialPivLU<MatrixXcd>;
extern template class FullPivLU<MatrixXd>;
extern template class HouseholderQR<MatrixXd>;
extern template class ColPivHouseholderQR<MatrixXd>;
extern template class ColPivHouseholderQR<MatrixXcd>;
extern template class FullPivHouseholderQR<MatrixXd>;
extern template class CompleteOrthogonalDecomposition<MatrixXd>;
extern template class JacobiSVD<MatrixXd>;
extern template class JacobiSVD<MatrixXd, HouseholderQRPreconditioner>;
extern template class JacobiSVD<MatrixXd, FullPivHouseholderQRPreconditioner>;
extern template class JacobiSVD<MatrixXcd>;
extern template class BDCSVD<MatrixXd>;
extern template class HessenbergDecomposition<MatrixXd>;
extern template class HessenbergDecomposition<MatrixXcd>;
extern template class Tridiagonalization<MatrixXd>;
extern template class RealSchur<MatrixXd>;
extern template class ComplexSchur<MatrixXd>;
extern template class ComplexSchur<MatrixXcd>;
extern template class EigenSolver<MatrixXd>;
extern template class ComplexEigenSolver<MatrixXd>;
extern template class ComplexEigenSolver<MatrixXcd>;
extern template class SelfAdjointEigenSolver<MatrixXd>;

}  // namespace Eigen
