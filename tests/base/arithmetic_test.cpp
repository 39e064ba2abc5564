// Products and sums that are computed at once: the same numbers as Eigen's
// expressions, and matrices as results.
#include <doctest/doctest.h>

#include <cmath>
#include <complex>

#include "base/math.hpp"

namespace pendula::arithmetic_test {

namespace {

using CMat = Eigen::MatrixXcd;
using Index = Eigen::Index;

/// Eigen's product, evaluated.
template <class A, class B>
auto product(const A& a, const B& b) {
  return Eigen::Product<A, B>(a, b).eval();
}

Mat numbers(Index rows, Index columns, double phase) {
  return Mat::NullaryExpr(rows, columns, [&](Index i, Index j) {
    return std::sin(phase + 1.7 * static_cast<double>(i) + 0.3 * static_cast<double>(i * j));
  });
}

template <class T>
constexpr bool is_matrix = std::is_same_v<T, Mat>;

}  // namespace

TEST_CASE("products are those of Eigen, to the last bit") {
  for (const Index n : {1, 3, 6, 7, 40, 150}) {
    CAPTURE(n);
    const Mat A = numbers(n, n, 0.1), B = numbers(n, n, 0.7), wide = numbers(n, n + 2, 1.9);
    const Vec b = A.col(0), c = B.col(n - 1);
    CHECK(A * B == product(A, B));
    CHECK(A * wide == product(A, wide));
    CHECK(A.transpose() * B == product(A.transpose(), B));
    CHECK(wide * wide.transpose() == product(wide, wide.transpose()));
    CHECK(A.transpose() * B.transpose() == product(A.transpose(), B.transpose()));
    CHECK(0.3 * A * B == product(0.3 * A, B));
    CHECK((0.3 * A.transpose()) * (0.7 * B) == product(0.3 * A.transpose(), 0.7 * B));
    CHECK(A.leftCols(1) * B.topRows(1) == product(A.leftCols(1), B.topRows(1)));
    CHECK(A * b == product(A, b));
    CHECK(A.transpose() * (0.3 * b) == product(A.transpose(), 0.3 * b));
    CHECK(A * B.row(0).transpose() == product(A, B.row(0).transpose()));
    CHECK(A * (b - c) == product(A, b - c));
    CHECK(b * c.transpose() == product(b, c.transpose()));
    CHECK(b.transpose() * A == product(b.transpose(), A));
    CHECK(A.row(0) * B.transpose() == product(A.row(0), B.transpose()));
  }
}

TEST_CASE("complex and long products are those of Eigen, too") {
  for (const Index n : {1, 3, 7, 40}) {
    CAPTURE(n);
    const CMat A = numbers(n, n, 0.1) + std::complex<double>(0, 1) * numbers(n, n, 0.7), B = A.adjoint();
    const CMat C = A.array() * A.array();
    CHECK(A * C == product(A, C));
    CHECK(A.adjoint() * C == product(B, C));
    CHECK(A * C.col(0) == product(A, C.col(0)));
    const Eigen::Matrix<long double, -1, -1> L = numbers(n, n, 0.1).cast<long double>();
    CHECK(L * L.transpose() == product(L, L.transpose()));
  }
}

TEST_CASE("sums of matrices and transposed ones") {
  const Mat A = numbers(5, 5, 0.1), B = numbers(5, 5, 0.7);
  Mat C = B;
  static_assert(is_matrix<decltype(A + B)> && is_matrix<decltype(A * B - C)> && is_matrix<decltype(-A)>);
  static_assert(is_matrix<decltype(A - A.transpose())> && is_matrix<decltype(A * B + C.transpose())>);
  for (Index i = 0; i < 5; ++i)
    for (Index j = 0; j < 5; ++j) {
      CHECK((A + B)(i, j) == A(i, j) + B(i, j));
      CHECK((A - B)(i, j) == A(i, j) - B(i, j));
      CHECK((-A)(i, j) == -A(i, j));
      CHECK((A + A.transpose())(i, j) == A(i, j) + A(j, i));
      CHECK((A - C.transpose())(i, j) == A(i, j) - B(j, i));
    }
  CHECK(A == numbers(5, 5, 0.1));  // operands stay what they are
  C = C * A + C;                   // also where the result is one of them
  CHECK(C == product(B, A) + B);
}

TEST_CASE("empty matrices") {
  const Mat none(3, 0), zero = none * none.transpose();
  CHECK(zero == Mat::Zero(3, 3));
  CHECK((none.transpose() * Vec::Ones(3)).size() == 0);
}

}  // namespace pendula::arithmetic_test
