// The `matrix factors` module: decompositions of matrices of numbers (src/expr/linalg/matrix_factors).
#include "expr/linalg/matrix_factors.hpp"
#include "base/text.hpp"
#include "lua/bind/expr/matrix.hpp"

namespace pendula::lua {
namespace {

Mat finite_matrix(Call& call, int i, const char* name) {
  Mat A = to_numeric_matrix(call.L, i, name);
  if (A.size() == 0) throw Error(text(name, " has no entries"));
  if (!A.allFinite()) throw Error(text(name, " has entries that are not finite numbers"));
  return A;
}

Mat finite_square(Call& call, int i, const char* name) {
  Mat A = finite_matrix(call, i, name);
  if (A.rows() != A.cols())
    throw Error(text(name, " must be square, not a ", A.rows(), "×", A.cols(), " matrix"));
  return A;
}

int svd(Call& call) {
  const linalg::SingularValues d(finite_matrix(call, 1, "A"));
  push_matrix(call.L, d.U);
  push_matrix(call.L, Mat(d.s));
  push_matrix(call.L, d.V);
  return 3;
}

int pinv(Call& call) { return push_value(call.L, linalg::pseudoinverse(finite_matrix(call, 1, "A"))); }

int cond(Call& call) { return call.push(linalg::condition_number(finite_matrix(call, 1, "A"))); }

int null_space(Call& call) {
  return push_matrix(call.L, linalg::orthonormal_null_space(finite_matrix(call, 1, "A")));
}

int qr(Call& call) {
  const linalg::OrthogonalFactors factors(finite_matrix(call, 1, "A"));
  push_matrix(call.L, factors.Q);
  push_matrix(call.L, factors.R);
  return 2;
}

int lu(Call& call) {
  const linalg::TriangularFactors factors(finite_square(call, 1, "A"));
  push_matrix(call.L, factors.L);
  push_matrix(call.L, factors.U);
  push_matrix(call.L, factors.P);
  return 3;
}

int chol(Call& call) { return push_matrix(call.L, linalg::cholesky_factor(finite_square(call, 1, "A"))); }

int kron(Call& call) {
  const MatX A = to_matrix(call.L, 1, "A"), B = to_matrix(call.L, 2, "B");
  return push_matrix(call.L, linalg::kronecker_product(A, B));
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
