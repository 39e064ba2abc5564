// The `matrix factors` module: decompositions of matrices of numbers, in doubles.
#include <cmath>

#include "base/decompositions.hpp"
#include "base/interrupt.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "lua/bind/expr/matrix.hpp"

namespace pendula::lua {
namespace {

Mat finite_matrix(Call& call, int i, const char* name) {
  Mat A = to_numeric_matrix(call.L, i, name);
  if (A.size() == 0) throw Error(text(name, " has no entries"));
  if (!A.allFinite()) throw Error(text(name, " has an entry that is no finite number"));
  return A;
}

Mat finite_square(Call& call, int i, const char* name) {
  Mat A = finite_matrix(call, i, name);
  if (A.rows() != A.cols())
    throw Error(text(name, " must be square, not a ", A.rows(), "×", A.cols(), " matrix"));
  return A;
}

/// Of a factorisation: `factor` times the longer size of A times the square of the shorter one.
double operations(const Mat& A, double factor) {
  const double longer = static_cast<double>(std::max(A.rows(), A.cols()));
  const double shorter = static_cast<double>(std::min(A.rows(), A.cols()));
  return factor * longer * shorter * shorter;
}

/// A = U diag(s) Vᵀ with as many columns as the smaller size of A; the largest entry of
/// every column of V is positive.
struct SingularValues {
  explicit SingularValues(const Mat& A) {
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
  /// Singular values above rounding: the largest size of A times ε times the largest of them (Golub & Van
  /// Loan, Matrix Computations, §5.4.1).
  Eigen::Index rank(const Mat& A) const {
    const double least = static_cast<double>(std::max(A.rows(), A.cols())) * 2.220446049250313e-16 * s[0];
    return (s.array() > least).count();
  }
  Mat U, V;
  Vec s;
};

int svd(Call& call) {
  const SingularValues d(finite_matrix(call, 1, "A"));
  push_matrix(call.L, d.U);
  push_matrix(call.L, Mat(d.s));
  push_matrix(call.L, d.V);
  return 3;
}

int pinv(Call& call) {
  const Mat A = finite_matrix(call, 1, "A");
  const SingularValues d(A);
  const Eigen::Index r = d.rank(A);
  Mat scaled = d.V.leftCols(r);
  for (Eigen::Index k = 0; k < r; ++k) scaled.col(k) /= d.s[k];
  return push_value(call.L, Mat(scaled * d.U.leftCols(r).transpose()));
}

int cond(Call& call) {
  const Mat A = finite_matrix(call, 1, "A");
  if (A.size() == 0) throw Error("a matrix without entries has no condition number");
  const SingularValues d(A);
  const double least = d.s[d.s.size() - 1];
  return call.push(least > 0 ? d.s[0] / least : std::numeric_limits<double>::infinity());
}

int null_space(Call& call) {
  const Mat A = finite_matrix(call, 1, "A");
  Mat tall = Mat::Zero(std::max(A.rows(), A.cols()), A.cols());  // so that V is square
  tall.topRows(A.rows()) = A;
  const SingularValues d(tall);
  const Eigen::Index r = d.rank(A);
  return push_matrix(call.L, Mat(d.V.rightCols(A.cols() - r)));
}

int qr(Call& call) {
  const Mat A = finite_matrix(call, 1, "A");
  const Eigen::Index k = std::min(A.rows(), A.cols());
  const std::vector<Mat> parts = stoppable(operations(A, 6), [&] {
    const Eigen::HouseholderQR<Mat> factors(A);
    return std::vector<Mat>{thin_q(factors.householderQ(), k), factors.matrixQR().topRows(k)};
  });
  Mat Q = parts[0], R = parts[1];
  for (Eigen::Index i = 0; i < k; ++i) {
    R.row(i).head(i).setZero();
    if (R(i, i) >= 0) continue;
    R.row(i) = -R.row(i);
    Q.col(i) = -Q.col(i);
  }
  push_matrix(call.L, Q);
  push_matrix(call.L, R);
  return 2;
}

int lu(Call& call) {
  const Mat A = finite_square(call, 1, "A");
  const std::vector<Mat> parts = stoppable(operations(A, 0.7), [&] {
    const Eigen::PartialPivLU<Mat> factors(A);
    return std::vector<Mat>{factors.matrixLU(), Mat(factors.permutationP())};
  });
  Mat L = Mat::Identity(A.rows(), A.cols()), U = Mat::Zero(A.rows(), A.cols());
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    U.col(j).head(j + 1) = parts[0].col(j).head(j + 1);
    L.col(j).tail(A.rows() - j - 1) = parts[0].col(j).tail(A.rows() - j - 1);
  }
  const Mat& P = parts[1];
  push_matrix(call.L, L);
  push_matrix(call.L, U);
  push_matrix(call.L, P);
  return 3;
}

int chol(Call& call) {
  const Mat A = finite_square(call, 1, "A");
  const double size = A.cwiseAbs().maxCoeff();
  for (Eigen::Index j = 0; j < A.cols(); ++j)
    for (Eigen::Index i = j + 1; i < A.rows(); ++i)
      if (std::fabs(A(i, j) - A(j, i)) > 1e-12 * size)
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
  return push_matrix(call.L, L);
}

int kron(Call& call) {
  const MatX A = to_matrix(call.L, 1, "A"), B = to_matrix(call.L, 2, "B");
  constexpr Eigen::Index most = 1'000'000;
  if (A.size() > 0 && B.size() > most / A.size())
    throw Error(text("kron(A, B) would have ", A.size(), "·", B.size(), " entries"));
  MatX C(A.rows() * B.rows(), A.cols() * B.cols());
  for (Eigen::Index i = 0; i < A.rows(); ++i)
    for (Eigen::Index j = 0; j < A.cols(); ++j)
      for (Eigen::Index k = 0; k < B.rows(); ++k)
        for (Eigen::Index l = 0; l < B.cols(); ++l) C(i * B.rows() + k, j * B.cols() + l) = A(i, j) * B(k, l);
  return push_matrix(call.L, C);
}

}  // namespace

extern const Module factors_module = {
    "matrix factors",
    "Decompositions of matrices of numbers",
    {
        {"svd", svd, "svd(A) -> U, s, V",
         R"(The singular value decomposition A = U diag(s) Vᵀ: orthonormal columns U and V, singular values s
            in falling order, as many as the smaller size of A.)",
         "U, s, V = svd{{3, 0}, {0, 4}, {0, 0}}  return s[1]", "4.0"},
        {"qr", qr, "qr(A) -> Q, R",
         R"(A = Q R with orthonormal columns Q and an upper triangle R whose diagonal is not negative.)",
         "Q, R = qr{{3, 1}, {4, 2}}  return R(1, 1)", "5.0"},
        {"lu", lu, "lu(A) -> L, U, P", "Gauss elimination with row exchanges: P A = L U.",
         "L, U, P = lu{{1, 2}, {2, 2}}  return U(2, 2)", "1.0"},
        {"chol", chol, "chol(A) -> L",
         R"(The Cholesky factor of a symmetric positive definite matrix, A = L Lᵀ; any other matrix is an
            error.)",
         "chol{{4, 2}, {2, 5}}(2, 2)", "2.0"},
        {"pinv", pinv, "pinv(A) -> matrix",
         R"(The pseudoinverse (Moore, Penrose): pinv(A)*b is the least-squares solution of least norm.)",
         "pinv{{1}, {1}}(1, 2)", "0.5"},
        {"cond", cond, "cond(A) -> number",
         R"(The condition number, the largest over the least singular value: relative errors of b grow by up to this
            factor in the solution of A x = b. Infinite for singular A.)",
         "cond{{2, 0}, {0, 0.5}}", "4.0"},
        {"null_space", null_space, "null_space(A) -> matrix",
         R"(Orthonormal columns that span the solutions of A x = 0; no columns where A has full column rank.)",
         "null_space{{1, 1}, {2, 2}}.cols", "1"},
        {"kron", kron, "kron(A, B) -> matrix", "The Kronecker product, of symbols too.",
         "kron({{1, 2}}, {{0, 1}})", "[0  1  0  2]"},
    }};

}  // namespace pendula::lua
