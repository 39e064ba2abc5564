// Eigen's factorisations of dense matrices. Those of double and complex are compiled once, in
// decompositions*.cpp: instantiating them in every file that uses them took half of a build.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

// Instantiating a class leaves out its member templates, and constructors from a matrix are such. `how` is `extern
// template` here and `template` in decompositions*.cpp.
#define PENDULA_FACTORISATION(how, Class, Matrix)     \
  how class Class<Matrix>;                            \
  how Class<Matrix>::Class(const EigenBase<Matrix>&); \
  how Class<Matrix>& Class<Matrix>::compute(const EigenBase<Matrix>&);

#define PENDULA_SPECTRUM(how, Class, Matrix, Option)          \
  how class Class<Matrix>;                                    \
  how Class<Matrix>::Class(const EigenBase<Matrix>&, Option); \
  how Class<Matrix>& Class<Matrix>::compute(const EigenBase<Matrix>&, Option);

#define PENDULA_SOLUTION(how, Class, Matrix, Right) \
  how void Class<Matrix>::_solve_impl<Right, Right>(const Right&, Right&) const;

#define PENDULA_FACTORISATIONS(how)                                     \
  PENDULA_FACTORISATION(how, LLT, MatrixXd)                             \
  PENDULA_FACTORISATION(how, PartialPivLU, MatrixXd)                    \
  PENDULA_FACTORISATION(how, PartialPivLU, MatrixXcd)                   \
  PENDULA_FACTORISATION(how, FullPivLU, MatrixXd)                       \
  PENDULA_FACTORISATION(how, HouseholderQR, MatrixXd)                   \
  PENDULA_FACTORISATION(how, ColPivHouseholderQR, MatrixXd)             \
  PENDULA_FACTORISATION(how, ColPivHouseholderQR, MatrixXcd)            \
  PENDULA_FACTORISATION(how, FullPivHouseholderQR, MatrixXd)            \
  PENDULA_FACTORISATION(how, CompleteOrthogonalDecomposition, MatrixXd) \
  PENDULA_SOLUTION(how, LLT, MatrixXd, MatrixXd)                        \
  PENDULA_SOLUTION(how, LLT, MatrixXd, VectorXd)                        \
  PENDULA_SOLUTION(how, PartialPivLU, MatrixXd, MatrixXd)               \
  PENDULA_SOLUTION(how, PartialPivLU, MatrixXd, VectorXd)               \
  PENDULA_SOLUTION(how, ColPivHouseholderQR, MatrixXd, MatrixXd)        \
  PENDULA_SOLUTION(how, ColPivHouseholderQR, MatrixXd, VectorXd)

#define PENDULA_SPECTRA(how)                                     \
  PENDULA_FACTORISATION(how, HessenbergDecomposition, MatrixXd)  \
  PENDULA_FACTORISATION(how, HessenbergDecomposition, MatrixXcd) \
  PENDULA_FACTORISATION(how, Tridiagonalization, MatrixXd)       \
  PENDULA_SPECTRUM(how, RealSchur, MatrixXd, bool)               \
  PENDULA_SPECTRUM(how, ComplexSchur, MatrixXd, bool)            \
  PENDULA_SPECTRUM(how, ComplexSchur, MatrixXcd, bool)           \
  PENDULA_SPECTRUM(how, EigenSolver, MatrixXd, bool)             \
  PENDULA_SPECTRUM(how, ComplexEigenSolver, MatrixXd, bool)      \
  PENDULA_SPECTRUM(how, ComplexEigenSolver, MatrixXcd, bool)     \
  PENDULA_SPECTRUM(how, SelfAdjointEigenSolver, MatrixXd, int)

namespace Eigen {

PENDULA_FACTORISATIONS(extern template)
PENDULA_SPECTRA(extern template)

extern template class JacobiSVD<MatrixXd>;
extern template class JacobiSVD<MatrixXcd>;
extern template class BDCSVD<MatrixXd>;

}  // namespace Eigen
