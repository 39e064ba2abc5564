// Principal square roots and logarithms of matrices of doubles, by the complex Schur form A = U T Uᴴ.
//
// √T of a triangular T by the recursion of Björck & Hammarling (Linear Algebra Appl. 52/53, 1983). log T by
// inverse scaling and squaring: square roots until ‖T^{1/2^s} - I‖ is small, then the Padé approximant of
// log(I + X) as a sum of partial fractions (Higham, Functions of Matrices, 2008, §11.5; Al-Mohy & Higham,
// SIAM J. Sci. Comput. 34(4), 2012), with the nodes and weights of Gauss–Legendre quadrature on [0, 1]. The
// diagonal of log T is log λ directly, and the diagonal of T^{1/2^s} - I is formed without cancellation.
#include <algorithm>
#include <cmath>
#include <complex>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"

namespace pendula::linalg {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using ComplexMat = Eigen::MatrixXcd;

void require_square_and_finite(const Mat& a) {
  if (a.rows() != a.cols()) throw Error(text("the matrix must be square, not ", a.rows(), "×", a.cols()));
  if (!a.allFinite()) throw Error("the matrix has entries that are not finite numbers");
}

/// The principal √T of an upper triangular T: Rᵢⱼ = (Tᵢⱼ - Σ Rᵢₖ Rₖⱼ) / (Rᵢᵢ + Rⱼⱼ).
ComplexMat triangular_root(const ComplexMat& T) {
  const Index n = T.rows();
  ComplexMat R = ComplexMat::Zero(n, n);
  for (Index j = 0; j < n; ++j) {
    R(j, j) = std::sqrt(T(j, j));
    for (Index i = j; i-- > 0;) {
      Complex sum = T(i, j);
      for (Index k = i + 1; k < j; ++k) sum -= R(i, k) * R(k, j);
      const Complex both = R(i, i) + R(j, j);
      if (sum != 0.0 && both == 0.0) throw Error("the matrix is singular and has no square root");
      R(i, j) = sum == 0.0 ? 0.0 : sum / both;
    }
  }
  return R;
}

/// z^{1/2^s} - 1 = exp(log z / 2^s) - 1 without cancellation.
Complex root_minus_one(Complex z, int s) {
  const Complex w = std::log(z) / std::ldexp(1.0, s);
  const double half = std::sin(w.imag() / 2);
  return {std::expm1(w.real()) * std::cos(w.imag()) - 2 * half * half,
          std::exp(w.real()) * std::sin(w.imag())};
}

/// Σ wₖ X (I + xₖ X)⁻¹, the [8/8] Padé approximant of log(I + X): relative error below 2⁻⁵³ for ‖X‖ ≤ 0.25.
ComplexMat log_near_identity(const ComplexMat& X) {
  constexpr int nodes = 8;
  Mat jacobi = Mat::Zero(nodes, nodes);  // Golub & Welsch: nodes and weights from the recurrence of Legendre
  for (int k = 1; k < nodes; ++k)
    jacobi(k, k - 1) = jacobi(k - 1, k) = 0.5 / std::sqrt(1 - 1.0 / (4.0 * k * k));
  const Eigen::SelfAdjointEigenSolver<Mat> eigen(jacobi);
  const Index n = X.rows();
  ComplexMat sum = ComplexMat::Zero(n, n);
  for (Index k = 0; k < nodes; ++k) {
    const double x = 0.5 * (1 + eigen.eigenvalues()[k]), w = std::pow(eigen.eigenvectors()(0, k), 2);
    const ComplexMat shifted = ComplexMat::Identity(n, n) + x * X;
    sum += w * shifted.triangularView<Eigen::Upper>().solve(X);
  }
  return sum;
}

ComplexMat triangular_log(const ComplexMat& T) {
  constexpr int most_roots = 100;  // a cap: the logarithm halves each time, and ln of a double is below 710
  constexpr double near = 0.25;    // see log_near_identity()
  const Index n = T.rows();
  const ComplexMat I = ComplexMat::Identity(n, n);
  ComplexMat R = T;
  int s = 0;
  while (!((R - I).cwiseAbs().colwise().sum().maxCoeff() <= near)) {
    if (++s > most_roots || !R.allFinite()) throw Failure("the logarithm of the matrix did not converge");
    R = triangular_root(R);
  }
  ComplexMat X = R - I;
  for (Index i = 0; i < n; ++i) X(i, i) = root_minus_one(T(i, i), s);
  ComplexMat L = std::ldexp(1.0, s) * log_near_identity(X);
  for (Index i = 0; i < n; ++i) L(i, i) = std::log(T(i, i));
  return L;
}

/// Throws an error that names an eigenvalue on the closed negative real axis. `what`:
/// "logarithm", "square root".
void require_principal(const Eigen::VectorXcd& eigenvalues, const Mat& a, const char* what, bool zero) {
  const double tiny = 1e-14 * a.norm();  // 45 ε: an eigenvalue that is 0 but for rounding
  constexpr double real = 1e-10;         // of |z|: computed simple eigenvalues on the axis err by less
  for (const Complex z : eigenvalues) {
    if (std::abs(z) <= tiny && !zero)
      throw Error(text("the matrix has the eigenvalue 0 and therefore no ", what));
    if (z.real() < 0 && std::abs(z) > tiny && std::fabs(z.imag()) <= real * std::abs(z))
      throw Error(text("the matrix has the eigenvalue ", rounded(z.real(), 6),
                       " on the negative real axis: it has no real principal ", what));
  }
}

/// The number of operations; a complex one counts as four.
double schur_cost(const Mat& a) { return 100 * std::pow(static_cast<double>(a.rows()), 3); }

template <class Function>
Mat by_schur_form(const Mat& a, const char* what, bool zero, const Function& f) {
  require_square_and_finite(a);
  if (a.size() == 0) return a;
  const Vec d = balancing(a);
  const Vec inverse = d.cwiseInverse();
  const Mat B = inverse.asDiagonal() * a * d.asDiagonal();
  // entries near 1: the squares of others overflow, and after ten iterations Eigen 3.4 reads outside of 2 × 2
  const double largest = B.cwiseAbs().maxCoeff();
  const double unit = largest > 0 ? std::exp2(std::floor(std::log2(largest))) : 1;
  const Eigen::ComplexSchur<Mat> schur(Mat(B / unit));
  const ComplexMat T = unit * schur.matrixT();
  require_principal(T.diagonal(), B, what, zero);
  const ComplexMat U = schur.matrixU(), F = U * f(T.triangularView<Eigen::Upper>()) * U.adjoint();
  return d.asDiagonal() * F.real() * inverse.asDiagonal();
}

}  // namespace

Mat logarithm(const Mat& a) {
  return stoppable(schur_cost(a), [&] {
    return std::vector<Mat>{
        by_schur_form(a, "logarithm", false, [](const ComplexMat& T) { return triangular_log(T); })};
  })[0];
}

Mat square_root(const Mat& a) {
  return stoppable(schur_cost(a), [&] {
    return std::vector<Mat>{
        by_schur_form(a, "square root", true, [](const ComplexMat& T) { return triangular_root(T); })};
  })[0];
}

}  // namespace pendula::linalg
