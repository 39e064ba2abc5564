// Eigen's factorisations of dense matrices. Those of double and complex are compiled once, in
// decompositions*.cpp: instantiating them in every file that uses them took half of a build. This holds
// for plain matrices as arguments: solve(Vec(-r)) is compiled already, solve(-r) would be compiled
// anew, and everything below it.
#pragma once

#include "base/math.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <complex>

// What is used of a class; a whole class has products of its factors besides, which nobody asks for. `how` is
// `extern template` here and `template` in decompositions*.cpp.
#define PENDULA_FACTORISATION(how, Class, Matrix)     \
  how Class<Matrix>::Class(const EigenBase<Matrix>&); \
  how Class<Matrix>& Class<Matrix>::compute(const EigenBase<Matrix>&);

// Constructors and compute() are written in their classes, so that a compiler may look
// into them; the work is done here.
#define PENDULA_IN_PLACE(how, Class, Matrix) \
  PENDULA_FACTORISATION(how, Class, Matrix)  \
  how void Class<Matrix>::computeInPlace();

#define PENDULA_PARTIAL_PIVOTING(how, Matrix)      \
  PENDULA_FACTORISATION(how, PartialPivLU, Matrix) \
  how void PartialPivLU<Matrix>::compute();        \
  how double internal::rcond_estimate_helper(double, const PartialPivLU<Matrix>&);

#define PENDULA_SPECTRUM(how, Class, Matrix, Option)          \
  how Class<Matrix>::Class(const EigenBase<Matrix>&, Option); \
  how Class<Matrix>& Class<Matrix>::compute(const EigenBase<Matrix>&, Option);

#define PENDULA_SOLUTION(how, Class, Matrix, Right) \
  how void Class<Matrix>::_solve_impl<Right, Right>(const Right&, Right&) const;

#define PENDULA_TRIANGULAR_FACTORS(how)                     \
  PENDULA_FACTORISATION(how, LLT, MatrixXd)                 \
  PENDULA_FACTORISATION(how, LDLT, MatrixXd)                \
  PENDULA_PARTIAL_PIVOTING(how, MatrixXd)                   \
  PENDULA_PARTIAL_PIVOTING(how, MatrixXcd)                  \
  PENDULA_IN_PLACE(how, FullPivLU, MatrixXd)                \
  PENDULA_SOLUTION(how, LLT, MatrixXd, MatrixXd)            \
  PENDULA_SOLUTION(how, LLT, MatrixXd, VectorXd)            \
  PENDULA_SOLUTION(how, LDLT, MatrixXd, MatrixXd)           \
  PENDULA_SOLUTION(how, PartialPivLU, MatrixXd, MatrixXd)   \
  PENDULA_SOLUTION(how, PartialPivLU, MatrixXd, VectorXd)   \
  PENDULA_SOLUTION(how, PartialPivLU, MatrixXcd, MatrixXcd) \
  PENDULA_SOLUTION(how, FullPivLU, MatrixXd, VectorXd)

#define PENDULA_ORTHOGONAL_FACTORS(how)                                      \
  PENDULA_IN_PLACE(how, HouseholderQR, MatrixXd)                             \
  PENDULA_IN_PLACE(how, ColPivHouseholderQR, MatrixXd)                       \
  PENDULA_IN_PLACE(how, ColPivHouseholderQR, MatrixXcd)                      \
  PENDULA_IN_PLACE(how, CompleteOrthogonalDecomposition, MatrixXd)           \
  PENDULA_SOLUTION(how, HouseholderQR, MatrixXd, VectorXd)                   \
  PENDULA_SOLUTION(how, ColPivHouseholderQR, MatrixXd, MatrixXd)             \
  PENDULA_SOLUTION(how, ColPivHouseholderQR, MatrixXd, VectorXd)             \
  PENDULA_SOLUTION(how, CompleteOrthogonalDecomposition, MatrixXd, MatrixXd) \
  PENDULA_SOLUTION(how, CompleteOrthogonalDecomposition, MatrixXd, VectorXd)

#define PENDULA_REAL_SPECTRA(how)                               \
  PENDULA_FACTORISATION(how, HessenbergDecomposition, MatrixXd) \
  PENDULA_FACTORISATION(how, Tridiagonalization, MatrixXd)      \
  PENDULA_SPECTRUM(how, RealSchur, MatrixXd, bool)              \
  PENDULA_SPECTRUM(how, EigenSolver, MatrixXd, bool)            \
  PENDULA_SPECTRUM(how, SelfAdjointEigenSolver, MatrixXd, int)

#define PENDULA_COMPLEX_SPECTRA(how)                             \
  PENDULA_FACTORISATION(how, HessenbergDecomposition, MatrixXcd) \
  PENDULA_SPECTRUM(how, ComplexSchur, MatrixXd, bool)            \
  PENDULA_SPECTRUM(how, ComplexSchur, MatrixXcd, bool)           \
  PENDULA_SPECTRUM(how, ComplexEigenSolver, MatrixXcd, bool)

// The kernels of products and triangular systems, of double and complex numbers
// (decompositions_spectral.cpp): every file that multiplies two matrices would make its own.
#define PENDULA_PACKING(how, S, Order)                                                                   \
  how struct gemm_pack_lhs<S, Index, const_blas_data_mapper<S, Index, Order>, gebp_traits<S, S>::mr,     \
                           gebp_traits<S, S>::LhsProgress, gebp_traits<S, S>::LhsPacket4Packing, Order>; \
  how struct gemm_pack_rhs<S, Index, const_blas_data_mapper<S, Index, Order>, gebp_traits<S, S>::nr, Order>;

#define PENDULA_MATRIX_VECTOR(how, S, Order, Right, version)                                                \
  how struct general_matrix_vector_product<Index, S, const_blas_data_mapper<S, Index, Order>, Order, false, \
                                           S, const_blas_data_mapper<S, Index, Right>, false, version>;

#define PENDULA_MATRIX_MATRIX(how, S, Left, Right) \
  how struct general_matrix_matrix_product<Index, S, Left, false, S, Right, false, ColMajor, 1>;

#define PENDULA_TRIANGULAR(how, S, mode)                                                       \
  how struct triangular_solve_matrix<S, Index, OnTheLeft, mode, false, ColMajor, ColMajor, 1>; \
  how struct triangular_solve_vector<S, S, Index, OnTheLeft, mode, false, ColMajor>;

#define PENDULA_KERNELS(how, S)                                                                             \
  PENDULA_PACKING(how, S, ColMajor)                                                                         \
  PENDULA_PACKING(how, S, RowMajor)                                                                         \
  how struct gemm_pack_rhs<S, Index, blas_data_mapper<S, Index, ColMajor>, gebp_traits<S, S>::nr, ColMajor, \
                           false, true>;                                                                    \
  how struct gebp_kernel<S, S, Index, blas_data_mapper<S, Index, ColMajor>, gebp_traits<S, S>::mr,          \
                         gebp_traits<S, S>::nr, false, false>;                                              \
  how void evaluateProductBlockingSizesHeuristic<S, S, 1, Index>(Index&, Index&, Index&, Index);            \
  how void evaluateProductBlockingSizesHeuristic<S, S, 4, Index>(Index&, Index&, Index&, Index);            \
  PENDULA_MATRIX_VECTOR(how, S, RowMajor, ColMajor, 0)                                                      \
  PENDULA_MATRIX_VECTOR(how, S, RowMajor, RowMajor, 1)                                                      \
  PENDULA_MATRIX_VECTOR(how, S, ColMajor, RowMajor, 0)                                                      \
  PENDULA_MATRIX_VECTOR(how, S, ColMajor, ColMajor, 0)                                                      \
  PENDULA_MATRIX_MATRIX(how, S, ColMajor, ColMajor)                                                         \
  PENDULA_MATRIX_MATRIX(how, S, ColMajor, RowMajor)                                                         \
  PENDULA_MATRIX_MATRIX(how, S, RowMajor, ColMajor)                                                         \
  PENDULA_TRIANGULAR(how, S, Lower)                                                                         \
  PENDULA_TRIANGULAR(how, S, UnitLower)                                                                     \
  PENDULA_TRIANGULAR(how, S, Upper)

namespace Eigen::internal {

PENDULA_KERNELS(extern template, double)
PENDULA_KERNELS(extern template, std::complex<double>)

}  // namespace Eigen::internal

namespace Eigen {

PENDULA_TRIANGULAR_FACTORS(extern template)
PENDULA_ORTHOGONAL_FACTORS(extern template)
PENDULA_REAL_SPECTRA(extern template)
PENDULA_COMPLEX_SPECTRA(extern template)

extern template class JacobiSVD<MatrixXd>;
extern template class JacobiSVD<MatrixXcd>;
extern template class BDCSVD<MatrixXd>;

}  // namespace Eigen

namespace pendula {

using HouseholderProduct = Eigen::HouseholderSequence<Mat, Vec>;

Mat full_q(const HouseholderProduct& q);
Mat thin_q(const HouseholderProduct& q, Eigen::Index columns);    ///< its first columns
Vec times_transposed(const HouseholderProduct& q, const Vec& v);  ///< qᵀ v
Mat inverse_by_lu(const Mat& A);  ///< of Eigen, without the checks of expr/linalg
Mat inverse_by_lu(const Eigen::PartialPivLU<Mat>& factors);
double determinant_by_lu(const Mat& A);
Mat pseudo_inverse(const Eigen::CompleteOrthogonalDecomposition<Mat>& factors);

}  // namespace pendula
