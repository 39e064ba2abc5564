#include "expr/graph/rational.hpp"

#include <cmath>

#include "base/interrupt.hpp"

namespace pendula::rational {

Rows integer_rows(const MatX& a, std::vector<mpq_class>& scale) {
  Rows rows(static_cast<std::size_t>(a.rows()));
  scale.clear();
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    mpz_class denominator = 1, factor = 0;
    for (Eigen::Index j = 0; j < a.cols(); ++j)
      denominator = lcm(denominator, exact_value(a(i, j))->get_den());
    auto& row = rows[i];
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      const mpq_class& q = *exact_value(a(i, j));
      row.push_back(q.get_num() * (denominator / q.get_den()));
      factor = gcd(factor, row.back());
    }
    if (factor > 1)
      for (mpz_class& entry : row) entry /= factor;
    mpq_class multiplied(denominator, factor == 0 ? mpz_class(1) : factor);
    multiplied.canonicalize();
    scale.push_back(multiplied);
  }
  return rows;
}

Echelon eliminate(Rows rows, int columns) {
  Echelon e;
  std::size_t rank = 0;
  for (int c = 0; c < columns && rank < rows.size(); ++c) {
    std::size_t best = rank;
    while (best < rows.size() && rows[best][c] == 0) ++best;
    if (best == rows.size()) continue;
    if (best != rank) {
      std::swap(rows[best], rows[rank]);
      e.sign = -e.sign;
    }
    const mpz_class pivot = rows[rank][c];
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (i == rank) continue;
      poll_interrupt();
      const mpz_class factor = rows[i][c];
      for (std::size_t j = 0; j < rows[i].size(); ++j) {
        mpz_class& entry = rows[i][j];  // (pivot·aᵢⱼ - aᵢc·aᵣⱼ) / previous pivot: exact, Sylvester's identity
        entry *= pivot;
        if (factor != 0) entry -= factor * rows[rank][j];
        mpz_divexact(entry.get_mpz_t(), entry.get_mpz_t(), e.pivot.get_mpz_t());
      }
    }
    e.pivot = pivot;
    e.pivot_column.push_back(c);
    ++rank;
  }
  e.rows = std::move(rows);
  return e;
}

std::optional<MatX> solve(const MatX& a, const MatX& b) {
  const auto n = static_cast<std::size_t>(a.rows());
  MatX both(a.rows(), a.cols() + b.cols());
  both << a, b;
  std::vector<mpq_class> scale;
  const Echelon e = eliminate(integer_rows(both, scale), static_cast<int>(n));
  if (e.pivot_column.size() < n) return {};
  MatX x(a.cols(), b.cols());
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    for (Eigen::Index j = 0; j < x.cols(); ++j) {
      mpq_class q(e.rows[i][a.cols() + j], e.pivot);
      q.canonicalize();
      x(i, j) = Expr(q);
    }
  return x;
}

std::optional<VecX> null_vector(const Echelon& e, int columns) {
  int free_column = 0;
  while (free_column < static_cast<int>(e.pivot_column.size()) && e.pivot_column[free_column] == free_column)
    ++free_column;
  if (free_column >= columns) return {};
  std::vector<mpz_class> v(static_cast<std::size_t>(columns));
  v[free_column] = e.pivot;
  mpz_class factor = e.pivot;
  for (std::size_t i = 0; i < e.pivot_column.size(); ++i) {
    v[e.pivot_column[i]] = -e.rows[i][free_column];
    factor = gcd(factor, v[e.pivot_column[i]]);
  }
  // makes the first nonzero entry positive
  for (const mpz_class& entry : v)
    if (entry != 0) {
      if (entry < 0) factor = -factor;
      break;
    }
  VecX result(columns);
  for (int i = 0; i < columns; ++i) result[i] = Expr(mpq_class(v[i] / factor));
  return result;
}

std::vector<mpq_class> characteristic(const MatX& a) {
  const auto n = static_cast<std::size_t>(a.rows());
  std::vector<std::vector<mpq_class>> matrix(n, std::vector<mpq_class>(n)), m(n, std::vector<mpq_class>(n));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      matrix[i][j] = *exact_value(a(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
  std::vector<mpq_class> c{1};
  // M₁ = I, Mₖ₊₁ = A Mₖ + cₖ I, cₖ = -tr(A Mₖ)/k (Faddeev–LeVerrier).
  for (std::size_t i = 0; i < n; ++i) m[i][i] = 1;
  for (std::size_t k = 1; k <= n; ++k) {
    std::vector<std::vector<mpq_class>> am(n, std::vector<mpq_class>(n));
    mpq_class trace = 0;
    for (std::size_t i = 0; i < n; ++i) {
      poll_interrupt();
      for (std::size_t l = 0; l < n; ++l) {
        if (matrix[i][l] == 0) continue;
        for (std::size_t j = 0; j < n; ++j) am[i][j] += matrix[i][l] * m[l][j];
      }
      trace += am[i][i];
    }
    c.push_back(-trace / static_cast<unsigned long>(k));
    for (std::size_t i = 0; i < n; ++i) am[i][i] += c.back();
    m = std::move(am);
  }
  return c;
}

namespace {

mpq_class horner(const std::vector<mpq_class>& p, const mpq_class& x) {
  mpq_class value = 0;
  for (const mpq_class& c : p) value = value * x + c;
  return value;
}

/// p / (s - root), remainder zero.
void deflate(std::vector<mpq_class>& p, const mpq_class& root) {
  for (std::size_t i = 1; i < p.size(); ++i) p[i] += p[i - 1] * root;
  p.pop_back();
}

/// The convergents of a double with denominators up to 10⁶; a rational root near it is one of them.
std::vector<mpq_class> convergents(double value) {
  std::vector<mpq_class> list;
  mpz_class p0 = 1, q0 = 0, p1 = std::floor(value), q1 = 1;
  double rest = value - std::floor(value);
  // denominators grow at least like Fibonacci numbers, in 31 steps to 10⁶; a rest of 10⁻¹² leads beyond that
  constexpr int most = 40;
  constexpr double none = 1e-12;
  for (int step = 0; step < most && q1 < 1'000'000; ++step) {
    list.emplace_back(p1, q1);
    list.emplace_back(p1 + 1, q1);  // its neighbour, if rounding ended on the wrong side of an integer
    list.back().canonicalize();
    if (rest < none) break;
    rest = 1 / rest;
    const mpz_class whole = std::floor(rest);
    rest -= std::floor(rest);
    const mpz_class p2 = whole * p1 + p0, q2 = whole * q1 + q0;
    p0 = p1;
    q0 = q1;
    p1 = p2;
    q1 = q2;
  }
  return list;
}

}  // namespace

std::vector<mpq_class> divide_rational_roots(std::vector<mpq_class>& polynomial,
                                             const std::vector<double>& near) {
  std::vector<mpq_class> roots;
  for (double value : near) {
    if (!std::isfinite(value)) continue;  // coefficients beyond the range of double
    for (const mpq_class& candidate : convergents(value)) {
      if (polynomial.size() < 2 || horner(polynomial, candidate) != 0) continue;
      while (polynomial.size() > 1 && horner(polynomial, candidate) == 0) {
        roots.push_back(candidate);
        deflate(polynomial, candidate);
      }
      break;
    }
  }
  return roots;
}

}  // namespace pendula::rational
