#include "base/arithmetic.hpp"

#include "base/decompositions.hpp"

namespace pendula {
namespace {

/// Eigen's own product.
template <class A, class B>
Eigen::Product<A, B> product(const A& a, const B& b) {
  return {a, b};
}

}  // namespace

namespace arithmetic {

template <Number S>
MatrixOf<S> matrix_times_matrix(View<MatrixOf<S>> A, bool A_transposed, View<MatrixOf<S>> B,
                                bool B_transposed) {
  if (A_transposed && B_transposed) return product(A.transpose(), B.transpose());
  if (A_transposed) return product(A.transpose(), B);
  if (B_transposed) return product(A, B.transpose());
  return product(A, B);
}

template <Number S>
VectorOf<S> matrix_times_vector(View<MatrixOf<S>> A, bool A_transposed, View<VectorOf<S>> b) {
  if (A_transposed) return product(A.transpose(), b);
  return product(A, b);
}

template <Number S>
MatrixOf<S> column_times_row(View<VectorOf<S>> a, View<VectorOf<S>> b) {
  return product(a, b.transpose());
}

template <Number S>
RowOf<S> row_times_matrix(View<VectorOf<S>> a, View<MatrixOf<S>> B, bool B_transposed) {
  return matrix_times_vector<S>(B, !B_transposed, a).transpose();  // like Eigen
}

template <Number S>
void scale(MatrixOf<S>& A, S factor) {
  A *= factor;
}

template <Number S>
void scale(VectorOf<S>& a, S factor) {
  a *= factor;
}

template <Number S>
void scale(RowOf<S>& a, S factor) {
  a *= factor;
}

template <Number S>
MatrixOf<S> operator+(MatrixOf<S> A, const MatrixOf<S>& B) {
  A += B;
  return A;
}

template <Number S>
MatrixOf<S> operator-(MatrixOf<S> A, const MatrixOf<S>& B) {
  A -= B;
  return A;
}

template <Number S>
MatrixOf<S> operator-(MatrixOf<S> A) {
  A = A.unaryExpr([](S x) { return -x; });
  return A;
}

template <Number S>
MatrixOf<S> operator+(MatrixOf<S> A, const Eigen::Transpose<const MatrixOf<S>>& B_transposed) {
  A += B_transposed;
  return A;
}

template <Number S>
MatrixOf<S> operator-(MatrixOf<S> A, const Eigen::Transpose<const MatrixOf<S>>& B_transposed) {
  A -= B_transposed;
  return A;
}

template MatrixOf<double> matrix_times_matrix(View<MatrixOf<double>>, bool, View<MatrixOf<double>>, bool);
template VectorOf<double> matrix_times_vector(View<MatrixOf<double>>, bool, View<VectorOf<double>>);
template MatrixOf<double> column_times_row(View<VectorOf<double>>, View<VectorOf<double>>);
template RowOf<double> row_times_matrix(View<VectorOf<double>>, View<MatrixOf<double>>, bool);
template void scale(MatrixOf<double>&, double);
template void scale(VectorOf<double>&, double);
template void scale(RowOf<double>&, double);
template MatrixOf<double> operator+(MatrixOf<double>, const MatrixOf<double>&);
template MatrixOf<double> operator-(MatrixOf<double>, const MatrixOf<double>&);
template MatrixOf<double> operator-(MatrixOf<double>);
template MatrixOf<double> operator+(MatrixOf<double>, const Eigen::Transpose<const MatrixOf<double>>&);
template MatrixOf<double> operator-(MatrixOf<double>, const Eigen::Transpose<const MatrixOf<double>>&);

template MatrixOf<std::complex<double>> matrix_times_matrix(View<MatrixOf<std::complex<double>>>, bool,
                                                            View<MatrixOf<std::complex<double>>>, bool);
template VectorOf<std::complex<double>> matrix_times_vector(View<MatrixOf<std::complex<double>>>, bool,
                                                            View<VectorOf<std::complex<double>>>);
template MatrixOf<std::complex<double>> column_times_row(View<VectorOf<std::complex<double>>>,
                                                         View<VectorOf<std::complex<double>>>);
template RowOf<std::complex<double>> row_times_matrix(View<VectorOf<std::complex<double>>>,
                                                      View<MatrixOf<std::complex<double>>>, bool);
template void scale(MatrixOf<std::complex<double>>&, std::complex<double>);
template void scale(VectorOf<std::complex<double>>&, std::complex<double>);
template void scale(RowOf<std::complex<double>>&, std::complex<double>);
template MatrixOf<std::complex<double>> operator+(MatrixOf<std::complex<double>>,
                                                  const MatrixOf<std::complex<double>>&);
template MatrixOf<std::complex<double>> operator-(MatrixOf<std::complex<double>>,
                                                  const MatrixOf<std::complex<double>>&);
template MatrixOf<std::complex<double>> operator-(MatrixOf<std::complex<double>>);
template MatrixOf<std::complex<double>> operator+(
    MatrixOf<std::complex<double>>, const Eigen::Transpose<const MatrixOf<std::complex<double>>>&);
template MatrixOf<std::complex<double>> operator-(
    MatrixOf<std::complex<double>>, const Eigen::Transpose<const MatrixOf<std::complex<double>>>&);

template MatrixOf<long double> matrix_times_matrix(View<MatrixOf<long double>>, bool,
                                                   View<MatrixOf<long double>>, bool);
template VectorOf<long double> matrix_times_vector(View<MatrixOf<long double>>, bool,
                                                   View<VectorOf<long double>>);
template MatrixOf<long double> column_times_row(View<VectorOf<long double>>, View<VectorOf<long double>>);
template RowOf<long double> row_times_matrix(View<VectorOf<long double>>, View<MatrixOf<long double>>, bool);
template void scale(MatrixOf<long double>&, long double);
template void scale(VectorOf<long double>&, long double);
template void scale(RowOf<long double>&, long double);
template MatrixOf<long double> operator+(MatrixOf<long double>, const MatrixOf<long double>&);
template MatrixOf<long double> operator-(MatrixOf<long double>, const MatrixOf<long double>&);
template MatrixOf<long double> operator-(MatrixOf<long double>);
template MatrixOf<long double> operator+(MatrixOf<long double>,
                                         const Eigen::Transpose<const MatrixOf<long double>>&);
template MatrixOf<long double> operator-(MatrixOf<long double>,
                                         const Eigen::Transpose<const MatrixOf<long double>>&);

}  // namespace arithmetic
}  // namespace pendula
