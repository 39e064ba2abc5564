// Products and sums of dense matrices, computed at once.
//
// Eigen's A * B + C is an expression: a type of its own for every formula, whose evaluation is compiled
// in every file that writes it (half of what compiling linear systems took). Here the factors
// of * become views of memory and the product is one of the functions below, which are compiled
// once; + and - of two matrices return a matrix. The numbers are those that Eigen computes. Sums of
// vectors remain Eigen's: one pass, without memory.
//
// A namespace with operators of its own (pendula::lti, pendula::dae) says `using arithmetic::operator*;`
// beside them. A loop that must not allocate says `y.noalias() += A.lazyProduct(x)`.
//
// CAUTION: a product is a matrix and no longer an expression that refers to its factors: `auto
// r = A * B - c.col(0)` refers to a matrix that is gone at the semicolon. Name the type (Vec, Mat) of
// what is computed from a product.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <concepts>
#include <type_traits>
#include <utility>

namespace pendula::arithmetic {

template <class S>
using MatrixOf = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;
template <class S>
using VectorOf = Eigen::Matrix<S, Eigen::Dynamic, 1>;
template <class S>
using RowOf = Eigen::Matrix<S, 1, Eigen::Dynamic>;
/// A matrix or vector in memory, or a part of one; an expression is evaluated where it becomes one.
template <class Matrix>
using View = const Eigen::Ref<const Matrix>&;

template <class T>
concept Number =
    std::same_as<T, double> || std::same_as<T, std::complex<double>> || std::same_as<T, long double>;

/// A dense matrix, vector or expression of such numbers; no diagonal matrix or permutation.
template <class T>
concept Dense = requires(const T& t) {
  []<class D>(const Eigen::MatrixBase<D>&) {}(t);
  requires Number<typename T::Scalar>;
};

template <class T>
concept Matrix = Dense<T> && T::RowsAtCompileTime == Eigen::Dynamic&& T::ColsAtCompileTime == Eigen::Dynamic;
template <class T>
concept Column = Dense<T> && T::RowsAtCompileTime == Eigen::Dynamic&& T::ColsAtCompileTime == 1;
template <class T>
concept Row = Dense<T> && T::RowsAtCompileTime == 1 && T::ColsAtCompileTime == Eigen::Dynamic;
template <class T, class S>
concept MatrixOver = Matrix<T> && std::same_as<typename T::Scalar, S>;
template <class T, class S>
concept ColumnOver = Column<T> && std::same_as<typename T::Scalar, S>;
template <class T, class S>
concept RowOver = Row<T> && std::same_as<typename T::Scalar, S>;

/// What a factor is made of: s X or s Xᵀ, where X is stored.
template <class T>
struct Parts {
  static constexpr bool is_scaled = false, is_transposed = false;
  static const T& unscaled(const T& a) { return a; }
  static const T& stored(const T& a) { return a; }
};
template <class X>
struct Parts<Eigen::Transpose<X>> {
  static constexpr bool is_scaled = false, is_transposed = true;
  static const Eigen::Transpose<X>& unscaled(const Eigen::Transpose<X>& a) { return a; }
  static decltype(auto) stored(const Eigen::Transpose<X>& a) { return a.nestedExpression(); }
};
template <class S, class C, class X>
struct Parts<
    Eigen::CwiseBinaryOp<Eigen::internal::scalar_product_op<S, S>,
                         const Eigen::CwiseNullaryOp<Eigen::internal::scalar_constant_op<S>, C>, X>> {
  using Scaled =
      Eigen::CwiseBinaryOp<Eigen::internal::scalar_product_op<S, S>,
                           const Eigen::CwiseNullaryOp<Eigen::internal::scalar_constant_op<S>, C>, X>;
  using Rest = Parts<std::remove_const_t<X>>;
  static constexpr bool is_scaled = true, is_transposed = Rest::is_transposed;
  static decltype(auto) unscaled(const Scaled& a) { return a.rhs(); }
  static decltype(auto) stored(const Scaled& a) { return Rest::stored(a.rhs()); }
  static S scale(const Scaled& a) { return a.lhs().functor()(); }
};

/// op(A) op(B) with op(A) = Aᵀ where `transposed`.
template <Number S>
MatrixOf<S> matrix_times_matrix(View<MatrixOf<S>> A, bool A_transposed, View<MatrixOf<S>> B,
                                bool B_transposed);
/// op(A) b
template <Number S>
VectorOf<S> matrix_times_vector(View<MatrixOf<S>> A, bool A_transposed, View<VectorOf<S>> b);
/// a bᵀ
template <Number S>
MatrixOf<S> column_times_row(View<VectorOf<S>> a, View<VectorOf<S>> b);
/// aᵀ op(B)
template <Number S>
RowOf<S> row_times_matrix(View<VectorOf<S>> a, View<MatrixOf<S>> B, bool B_transposed);

template <Number S>
void scale(MatrixOf<S>& A, S factor);
template <Number S>
void scale(VectorOf<S>& a, S factor);
template <Number S>
void scale(RowOf<S>& a, S factor);

/// The product of two factors without their scales, with them: as Eigen rounds.
template <class A, class B, class Product>
Product with_scales(const A& a, const B& b, Product product) {
  if constexpr (Parts<A>::is_scaled && Parts<B>::is_scaled)
    scale(product, Parts<A>::scale(a) * Parts<B>::scale(b));
  else if constexpr (Parts<A>::is_scaled)
    scale(product, Parts<A>::scale(a));
  else if constexpr (Parts<B>::is_scaled)
    scale(product, Parts<B>::scale(b));
  return product;
}

template <Matrix A, MatrixOver<typename A::Scalar> B>
MatrixOf<typename A::Scalar> operator*(const A& a, const B& b) {
  return with_scales(a, b,
                     matrix_times_matrix<typename A::Scalar>(Parts<A>::stored(a), Parts<A>::is_transposed,
                                                             Parts<B>::stored(b), Parts<B>::is_transposed));
}

template <Matrix A, ColumnOver<typename A::Scalar> B>
VectorOf<typename A::Scalar> operator*(const A& a, const B& b) {
  return with_scales(a, b,
                     matrix_times_vector<typename A::Scalar>(Parts<A>::stored(a), Parts<A>::is_transposed,
                                                             Parts<B>::unscaled(b)));
}

template <Column A, RowOver<typename A::Scalar> B>
MatrixOf<typename A::Scalar> operator*(const A& a, const B& b) {
  return column_times_row<typename A::Scalar>(a, b.transpose());
}

template <Row A, MatrixOver<typename A::Scalar> B>
RowOf<typename A::Scalar> operator*(const A& a, const B& b) {
  return with_scales(a, b,
                     row_times_matrix<typename A::Scalar>(Parts<A>::unscaled(a).transpose(),
                                                          Parts<B>::stored(b), Parts<B>::is_transposed));
}

template <Number S>
MatrixOf<S> operator+(MatrixOf<S> A, const MatrixOf<S>& B);
template <Number S>
MatrixOf<S> operator-(MatrixOf<S> A, const MatrixOf<S>& B);
template <Number S>
MatrixOf<S> operator-(MatrixOf<S> A);

/// A + Bᵀ and A - Bᵀ
template <Number S>
MatrixOf<S> operator+(MatrixOf<S> A, const Eigen::Transpose<const MatrixOf<S>>& B_transposed);
template <Number S>
MatrixOf<S> operator-(MatrixOf<S> A, const Eigen::Transpose<const MatrixOf<S>>& B_transposed);

template <Number S>
MatrixOf<S> operator+(MatrixOf<S> A, const Eigen::Transpose<MatrixOf<S>>& B_transposed) {
  return std::move(A) + Eigen::Transpose<const MatrixOf<S>>(B_transposed.nestedExpression());
}
template <Number S>
MatrixOf<S> operator-(MatrixOf<S> A, const Eigen::Transpose<MatrixOf<S>>& B_transposed) {
  return std::move(A) - Eigen::Transpose<const MatrixOf<S>>(B_transposed.nestedExpression());
}

}  // namespace pendula::arithmetic

namespace pendula {

using arithmetic::operator+;
using arithmetic::operator-;
using arithmetic::operator*;

}  // namespace pendula
