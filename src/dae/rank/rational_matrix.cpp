#include "dae/rank/rational_matrix.hpp"

#include <algorithm>

#include "base/interrupt.hpp"

namespace pendula::dae {

RationalMatrix RationalMatrix::identity(int n) {
  RationalMatrix a(n, n);
  for (int i = 0; i < n; ++i) a(i, i) = 1;
  return a;
}

bool RationalMatrix::is_zero() const {
  return std::all_of(data_.begin(), data_.end(), [](const mpq_class& q) { return q == 0; });
}

RationalMatrix RationalMatrix::block(int row, int col, int rows, int cols) const {
  RationalMatrix part(rows, cols);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j) part(i, j) = (*this)(row + i, col + j);
  return part;
}

RationalMatrix RationalMatrix::transposed() const {
  RationalMatrix t(cols_, rows_);
  for (int i = 0; i < rows_; ++i)
    for (int j = 0; j < cols_; ++j) t(j, i) = (*this)(i, j);
  return t;
}

void RationalMatrix::set(int row, int col, const RationalMatrix& part) {
  for (int i = 0; i < part.rows(); ++i)
    for (int j = 0; j < part.cols(); ++j) (*this)(row + i, col + j) = part(i, j);
}

RationalMatrix operator*(const RationalMatrix& a, const RationalMatrix& b) {
  RationalMatrix c(a.rows(), b.cols());
  for (int i = 0; i < a.rows(); ++i) {
    poll_interrupt();
    for (int k = 0; k < a.cols(); ++k) {
      if (a(i, k) == 0) continue;
      for (int j = 0; j < b.cols(); ++j)
        if (b(k, j) != 0) c(i, j) += a(i, k) * b(k, j);
    }
  }
  return c;
}

RationalMatrix operator*(const mpq_class& factor, RationalMatrix a) {
  for (int i = 0; i < a.rows(); ++i)
    for (int j = 0; j < a.cols(); ++j) a(i, j) *= factor;
  return a;
}

RationalMatrix operator+(RationalMatrix a, const RationalMatrix& b) {
  for (int i = 0; i < a.rows(); ++i)
    for (int j = 0; j < a.cols(); ++j) a(i, j) += b(i, j);
  return a;
}

RationalMatrix operator-(RationalMatrix a, const RationalMatrix& b) {
  for (int i = 0; i < a.rows(); ++i)
    for (int j = 0; j < a.cols(); ++j) a(i, j) -= b(i, j);
  return a;
}

RationalMatrix hstack(const RationalMatrix& a, const RationalMatrix& b) {
  RationalMatrix c(std::max(a.rows(), b.rows()), a.cols() + b.cols());
  c.set(0, 0, a);
  c.set(0, a.cols(), b);
  return c;
}

RationalMatrix diagonal(const RationalMatrix& a, const RationalMatrix& b) {
  RationalMatrix c(a.rows() + b.rows(), a.cols() + b.cols());
  c.set(0, 0, a);
  c.set(a.rows(), a.cols(), b);
  return c;
}

Reduced reduced(RationalMatrix a, int columns) {
  Reduced result;
  int rank = 0;
  for (int c = 0; c < columns && rank < a.rows(); ++c) {
    int pivot = rank;
    while (pivot < a.rows() && a(pivot, c) == 0) ++pivot;
    if (pivot == a.rows()) continue;
    if (pivot != rank)
      for (int j = 0; j < a.cols(); ++j) std::swap(a(pivot, j), a(rank, j));
    const mpq_class scale = 1 / a(rank, c);
    for (int j = c; j < a.cols(); ++j)
      if (a(rank, j) != 0) a(rank, j) *= scale;
    for (int i = 0; i < a.rows(); ++i) {
      if (i == rank || a(i, c) == 0) continue;
      poll_interrupt();
      const mpq_class factor = a(i, c);
      for (int j = c; j < a.cols(); ++j)
        if (a(rank, j) != 0) a(i, j) -= factor * a(rank, j);
    }
    result.pivots.push_back(c);
    ++rank;
  }
  result.form = std::move(a);
  return result;
}

int rank(const RationalMatrix& a) { return static_cast<int>(reduced(a).pivots.size()); }

mpq_class determinant(RationalMatrix a) {
  mpq_class product = 1;
  for (int c = 0; c < a.cols(); ++c) {
    int pivot = c;
    while (pivot < a.rows() && a(pivot, c) == 0) ++pivot;
    if (pivot == a.rows()) return 0;
    if (pivot != c) {
      for (int j = c; j < a.cols(); ++j) std::swap(a(pivot, j), a(c, j));
      product = -product;
    }
    product *= a(c, c);
    for (int i = c + 1; i < a.rows(); ++i) {
      if (a(i, c) == 0) continue;
      poll_interrupt();
      const mpq_class factor = a(i, c) / a(c, c);
      for (int j = c; j < a.cols(); ++j)
        if (a(c, j) != 0) a(i, j) -= factor * a(c, j);
    }
  }
  return product;
}

std::optional<RationalMatrix> inverse(const RationalMatrix& a) {
  const int n = a.rows();
  const Reduced r = reduced(hstack(a, RationalMatrix::identity(n)), n);
  if (static_cast<int>(r.pivots.size()) < n) return {};
  return r.form.columns(n, n);
}

mpq_class primitive_factor(const RationalMatrix& v) {
  mpz_class denominators = 1, numerators = 0;
  int sign = 0;
  for (int i = 0; i < v.rows(); ++i)
    for (int j = 0; j < v.cols(); ++j) {
      const mpq_class& q = v(i, j);
      if (q == 0) continue;
      if (sign == 0) sign = sgn(q);
      denominators = lcm(denominators, q.get_den());
      numerators = gcd(numerators, q.get_num());
    }
  if (sign == 0) return 1;
  mpq_class factor(sign * denominators, numerators);
  factor.canonicalize();
  return factor;
}

namespace {

RationalMatrix primitive_columns(RationalMatrix basis) {
  for (int j = 0; j < basis.cols(); ++j) {
    const mpq_class factor = primitive_factor(basis.columns(j, 1));
    for (int i = 0; i < basis.rows(); ++i) basis(i, j) *= factor;
  }
  return basis;
}

}  // namespace

RationalMatrix kernel(const RationalMatrix& a) {
  const Reduced r = reduced(a);
  const int n = a.cols(), rank = static_cast<int>(r.pivots.size());
  RationalMatrix basis(n, n - rank);
  for (int free = 0, column = 0, p = 0; free < n; ++free) {
    if (p < rank && r.pivots[p] == free) {
      ++p;
      continue;
    }
    basis(free, column) = 1;
    for (int i = 0; i < rank; ++i) basis(r.pivots[i], column) = -r.form(i, free);
    ++column;
  }
  return span(basis);
}

RationalMatrix span(const RationalMatrix& a) {
  const Reduced r = reduced(a.transposed());
  return primitive_columns(r.form.block(0, 0, static_cast<int>(r.pivots.size()), a.rows()).transposed());
}

RationalMatrix preimage(const RationalMatrix& a, const RationalMatrix& b) {
  // a x = b y: the x part of the kernel of [a  -b]
  const RationalMatrix both = kernel(hstack(a, mpq_class(-1) * b));
  return span(both.block(0, 0, a.cols(), both.cols()));
}

RationalMatrix complement(const RationalMatrix& known, const RationalMatrix& candidates) {
  const Reduced r = reduced(hstack(known, candidates));
  RationalMatrix chosen(candidates.rows(), 0);
  for (int pivot : r.pivots)
    if (pivot >= known.cols()) chosen = hstack(chosen, candidates.columns(pivot - known.cols(), 1));
  return chosen;
}

MatX expressions(const RationalMatrix& a) {
  MatX m(a.rows(), a.cols());
  for (int i = 0; i < a.rows(); ++i)
    for (int j = 0; j < a.cols(); ++j) m(i, j) = Expr(a(i, j));
  return m;
}

VecX product(const RationalMatrix& a, const VecX& v) {
  VecX result = VecX::Zero(a.rows());
  for (int i = 0; i < a.rows(); ++i)
    for (int j = 0; j < a.cols(); ++j)
      if (a(i, j) != 0 && !v[j].is_zero()) result[i] += Expr(a(i, j)) * v[j];
  return result;
}

}  // namespace pendula::dae
