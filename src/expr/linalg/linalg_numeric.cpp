// The numerical counterpart of linalg.cpp: Eigen, with error messages for users.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"

namespace pendula::linalg {
namespace {

void require_square(const Mat& a) {
  if (a.rows() != a.cols()) throw Error(text("the matrix must be square, not ", a.rows(), "×", a.cols()));
}

void require_finite(const Mat& a) {
  if (!a.allFinite()) throw Error("the matrix has entries that are not finite numbers");
}

/// The cost of an operation on an n×n matrix: factor n³.
double cubic(const Mat& a, double factor) { return factor * std::pow(static_cast<double>(a.rows()), 3); }

/// LU with partial pivoting; throws an error with the null vector if the matrix is singular
/// to working precision.
Eigen::PartialPivLU<Mat> regular_lu(const Mat& a) {
  require_square(a);
  require_finite(a);
  Eigen::PartialPivLU<Mat> lu(a);
  if (a.size() == 0) return lu;
  const bool zero_pivot = (lu.matrixLU().diagonal().array() == 0).any();  // the estimate ignores it
  const double rcond = zero_pivot ? 0 : lu.rcond();
  // at 1/κ = ε no digit is left; the estimate may be too small by a factor of some units. NaN fails too
  if (rcond > eps / 4) return lu;
  const Eigen::BDCSVD<Mat> svd(a, Eigen::ComputeFullV);
  Vec v = svd.matrixV().rightCols(1);
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  v /= v[largest];
  std::vector<std::string> shown;
  constexpr Eigen::Index most_shown = 12;  // a line of a terminal
  constexpr double rounding = 1e-12;       // of the largest entry, 1: 4500 ε
  for (Eigen::Index i = 0; i < std::min(v.size(), most_shown); ++i)
    shown.push_back(rounded(std::fabs(v[i]) < rounding ? 0.0 : v[i], 5));
  if (v.size() > most_shown) shown.push_back("…");
  throw Error(text("the matrix is singular to working precision: A v = 0 for v = (", join(shown, ", "), ")"));
}

}  // namespace

int rank(const Mat& a) {
  require_finite(a);
  if (a.size() == 0) return 0;
  const double longer = static_cast<double>(std::max(a.rows(), a.cols()));
  const double shorter = static_cast<double>(std::min(a.rows(), a.cols()));
  const Vec s = stoppable(40 * longer * shorter * shorter,
                          [&] { return std::vector<Mat>{Eigen::BDCSVD<Mat>(a).singularValues()}; })[0];
  const double threshold = longer * eps * s[0];  // the backward error of a singular value decomposition
  return static_cast<int>((s.array() > threshold).count());
}

double determinant(const Mat& a) {
  require_square(a);
  require_finite(a);
  if (a.size() == 0) return 1;
  return stoppable(cubic(a, 0.7),
                   [&] { return std::vector<Mat>{Mat::Constant(1, 1, determinant_by_lu(a))}; })[0](0, 0);
}

Mat solve(const Mat& a, const Mat& b) {
  require_square(a);
  if (a.rows() != b.rows())
    throw Error(text("the matrix has ", a.rows(), " rows but the right-hand side has ", b.rows()));
  require_finite(b);
  const double n = static_cast<double>(a.rows());
  return stoppable(cubic(a, 0.7) + 2 * n * n * static_cast<double>(b.cols()),
                   [&] { return std::vector<Mat>{regular_lu(a).solve(b)}; })[0];
}

Mat inverse(const Mat& a) {
  require_square(a);
  return stoppable(cubic(a, 2.7), [&] { return std::vector<Mat>{inverse_by_lu(regular_lu(a))}; })[0];
}

namespace {

/// Re λ, Im λ, Re V, Im V, sorted.
std::vector<Mat> sorted_eigensystem(const Mat& a) {
  const Eigen::Index n = a.rows();
  std::vector<Mat> e{Mat(n, 1), Mat(n, 1), Mat(n, n), Mat(n, n)};
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
  if (a == a.transpose()) {  // orthonormal vectors and real values, without rounding into the complex plane
    const Eigen::SelfAdjointEigenSolver<Mat> solver(a);
    values = solver.eigenvalues().cast<std::complex<double>>();
    vectors = solver.eigenvectors().cast<std::complex<double>>();
  } else {
    const Vec d = balancing(a);  // since the error of the iteration is relative to the largest entry
    const Eigen::EigenSolver<Mat> solver(similar(a, d));
    if (solver.info() != Eigen::Success) throw Failure("the eigenvalue iteration did not converge");
    values = solver.eigenvalues();
    vectors = (d.asDiagonal() * solver.eigenvectors()).colwise().normalized();
  }
  std::vector<Eigen::Index> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Eigen::Index i, Eigen::Index j) {
    return std::pair(values[i].real(), values[i].imag()) < std::pair(values[j].real(), values[j].imag());
  });
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index i = order[k];
    e[0](k) = values[i].real();
    e[1](k) = values[i].imag();
    e[2].col(k) = vectors.col(i).real();
    e[3].col(k) = vectors.col(i).imag();
  }
  return e;
}

}  // namespace

Eigensystem eigensystem(const Mat& a) {
  require_square(a);
  require_finite(a);
  if (a.size() == 0) return {Vec(0), Vec(0), Mat(0, 0), Mat(0, 0)};
  auto e = stoppable(cubic(a, 40), [&] { return sorted_eigensystem(a); });
  return {e[0], e[1], std::move(e[2]), std::move(e[3])};
}

}  // namespace pendula::linalg
