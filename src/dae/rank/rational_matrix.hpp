// Dense matrices of rational numbers, and the subspaces they span. Small and exact:
// what pencil.hpp computes with.
//
// A subspace of ℚⁿ is a matrix whose columns are a basis. Bases are canonical: the reduced echelon form of
// the transposed, every column scaled to coprime integers with a positive first entry.
#pragma once

#include <optional>
#include <vector>

#include <gmpxx.h>

#include "base/arithmetic.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::dae {

class RationalMatrix {
 public:
  RationalMatrix() = default;
  RationalMatrix(int rows, int cols)
      : rows_(rows), cols_(cols), data_(static_cast<std::size_t>(rows) * cols) {}
  static RationalMatrix identity(int n);

  int rows() const { return rows_; }
  int cols() const { return cols_; }
  mpq_class& operator()(int i, int j) { return data_[i * cols_ + j]; }
  const mpq_class& operator()(int i, int j) const { return data_[i * cols_ + j]; }
  bool is_zero() const;

  RationalMatrix block(int row, int col, int rows, int cols) const;
  RationalMatrix columns(int first, int count) const { return block(0, first, rows_, count); }
  RationalMatrix row(int i) const { return block(i, 0, 1, cols_); }
  RationalMatrix transposed() const;
  void set(int row, int col, const RationalMatrix& part);

  friend bool operator==(const RationalMatrix&, const RationalMatrix&) = default;

 private:
  int rows_ = 0, cols_ = 0;
  std::vector<mpq_class> data_;
};

using arithmetic::operator+;  // of numbers, beside those below
using arithmetic::operator-;
using arithmetic::operator*;
RationalMatrix operator*(const RationalMatrix& a, const RationalMatrix& b);
RationalMatrix operator*(const mpq_class& factor, RationalMatrix a);
RationalMatrix operator+(RationalMatrix a, const RationalMatrix& b);
RationalMatrix operator-(RationalMatrix a, const RationalMatrix& b);
RationalMatrix hstack(const RationalMatrix& a, const RationalMatrix& b);  ///< [a b]
RationalMatrix diagonal(const RationalMatrix& a, const RationalMatrix& b);

/// Reduced echelon form: pivots 1, zeros above and below. Pivots are looked for in
/// the first `columns` columns.
struct Reduced {
  RationalMatrix form;
  std::vector<int> pivots;  ///< column of the pivot of row i; its size is the rank
};
Reduced reduced(RationalMatrix a, int columns);
inline Reduced reduced(RationalMatrix a) {
  const int all = a.cols();
  return reduced(std::move(a), all);
}
int rank(const RationalMatrix& a);
mpq_class determinant(RationalMatrix a);                                    ///< requires a square
std::optional<RationalMatrix> inverse(const RationalMatrix& a);             ///< requires a square
RationalMatrix kernel(const RationalMatrix& a);                             ///< {x : a x = 0}
RationalMatrix span(const RationalMatrix& a);                               ///< the column space
RationalMatrix preimage(const RationalMatrix& a, const RationalMatrix& b);  ///< {x : a x ∈ span b}
/// The columns of `candidates`, from the left, that extend `known` to the span of both.
RationalMatrix complement(const RationalMatrix& known, const RationalMatrix& candidates);

/// The factor that makes the entries of a row or column coprime integers, the first nonzero one positive.
mpq_class primitive_factor(const RationalMatrix& vector);

MatX expressions(const RationalMatrix& a);
VecX product(const RationalMatrix& a, const VecX& v);

}  // namespace pendula::dae
