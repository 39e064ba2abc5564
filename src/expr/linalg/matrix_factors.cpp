#include "expr/linalg/matrix_factors.hpp"

#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"

namespace pendula::linalg {

namespace {

/// Operations of a factorisation: `factor` times the larger dimension of A times the square of
/// the smaller one.
double operations(const Mat& A, double factor) {
  const double longer = static_cast<double>(std::max(A.rows(), A.cols()));
  const double shorter = static_cast<double>(std::min(A.rows(), A.cols()));
  return factor * longer * shorter * shorter;
}

}  // namespace

SingularValues::SingularValues(const Mat& A) {
  const std::vector<Mat> parts = stoppable(operations(A, 40), [&] {
    const Eigen::BDCSVD<Mat> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
    if (svd.info() != Eigen::Success) throw Error("the singular values did not converge");
    return std::vector<Mat>{svd.matrixU(), svd.matrixV(), svd.singularValues()};
  });
  U = parts[0];
  V = parts[1];
  s = parts[2];
  for (Eigen::Index k = 0; k < V.cols(); ++k) {
    Eigen::Index largest = 0;
    V.col(k).cwiseAbs().maxCoeff(&largest);
    if (V(largest, k) > 0) continue;
    V.col(k) = -V.col(k);
    U.col(k) = -U.col(k);
  }
}

Eigen::Index SingularValues::rank(const Mat& A) const {
  // max(m, n) ε σ₁, as in numpy.linalg.matrix_rank
  const double least = static_cast<double>(std::max(A.rows(), A.cols())) * eps * s[0];
  return (s.array() > least).count();
}

Mat pseudoinverse(const Mat& A) {
  const SingularValues d(A);
  const Eigen::Index r = d.rank(A);
  Mat scaled = d.V.leftCols(r);
  for (Eigen::Index k = 0; k < r; ++k) scaled.col(k) /= d.s[k];
  return scaled * d.U.leftCols(r).transpose();
}

double condition_number(const Mat& A) {
  const SingularValues d(A);
  const double least = d.s[d.s.size() - 1];
  return least > 0 ? d.s[0] / least : std::numeric_limits<double>::infinity();
}

Mat orthonormal_null_space(const Mat& A) {
  Mat tall = Mat::Zero(std::max(A.rows(), A.cols()), A.cols());  // so that V is square
  tall.topRows(A.rows()) = A;
  const SingularValues d(tall);
  const Eigen::Index r = d.rank(A);
  return d.V.rightCols(A.cols() - r);
}

OrthogonalFactors::OrthogonalFactors(const Mat& A) {
  const Eigen::Index k = std::min(A.rows(), A.cols());
  const std::vector<Mat> parts = stoppable(operations(A, 6), [&] {
    const Eigen::HouseholderQR<Mat> factors(A);
    return std::vector<Mat>{thin_q(factors.householderQ(), k), factors.matrixQR().topRows(k)};
  });
  Q = parts[0];
  R = parts[1];
  for (Eigen::Index i = 0; i < k; ++i) {
    R.row(i).head(i).setZero();
    if (R(i, i) >= 0) continue;
    R.row(i) = -R.row(i);
    Q.col(i) = -Q.col(i);
  }
}

TriangularFactors::TriangularFactors(const Mat& A)
    : L(Mat::Identity(A.rows(), A.cols())), U(Mat::Zero(A.rows(), A.cols())) {
  const std::vector<Mat> parts = stoppable(operations(A, 0.7), [&] {
    const Eigen::PartialPivLU<Mat> factors(A);
    return std::vector<Mat>{factors.matrixLU(), Mat(factors.permutationP())};
  });
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    U.col(j).head(j + 1) = parts[0].col(j).head(j + 1);
    L.col(j).tail(A.rows() - j - 1) = parts[0].col(j).tail(A.rows() - j - 1);
  }
  P = parts[1];
}

Mat cholesky_factor(const Mat& A) {
  constexpr double rounding = 1e-12;  // of the largest entry: 4500 ε
  const double size = A.cwiseAbs().maxCoeff();
  for (Eigen::Index j = 0; j < A.cols(); ++j)
    for (Eigen::Index i = j + 1; i < A.rows(); ++i)
      if (std::fabs(A(i, j) - A(j, i)) > rounding * size)
        throw Error(text("A must be symmetric, but A(", i + 1, ", ", j + 1, ") = ", rounded(A(i, j)),
                         " and A(", j + 1, ", ", i + 1, ") = ", rounded(A(j, i)),
                         "; its symmetric part is (A + A.T)/2"));
  Mat L = Mat::Zero(A.rows(), A.cols());
  for (Eigen::Index j = 0; j < A.cols(); ++j) {  // by columns, so that the error can name the minor
    poll_interrupt();
    const double pivot = A(j, j) - L.row(j).head(j).squaredNorm();
    if (!(pivot > 0))
      throw Error(text("A is not positive definite: its leading minor of size ", j + 1, " is ",
                       pivot == 0 ? "0" : "negative", "; eig(A) has its eigenvalues"));
    L(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < A.rows(); ++i)
      L(i, j) = (A(i, j) - L.row(i).head(j).dot(L.row(j).head(j))) / L(j, j);
  }
  return L;
}

MatX kronecker_product(const MatX& A, const MatX& B) {
  constexpr Eigen::Index most = 1'000'000;  // entries: 16 MB of new expressions if all differ
  if (A.size() > 0 && B.size() > most / A.size())
    throw Error(text("kron(A, B) would have ", A.size(), "·", B.size(), " entries"));
  MatX C(A.rows() * B.rows(), A.cols() * B.cols());
  for (Eigen::Index i = 0; i < A.rows(); ++i)
    for (Eigen::Index j = 0; j < A.cols(); ++j)
      for (Eigen::Index k = 0; k < B.rows(); ++k)
        for (Eigen::Index l = 0; l < B.cols(); ++l) C(i * B.rows() + k, j * B.cols() + l) = A(i, j) * B(k, l);
  return C;
}

}  // namespace pendula::linalg
