#include "expr/linalg/linalg.hpp"

#include <algorithm>
#include <bit>
#include <unordered_map>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/rational.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::linalg {
namespace {

using generic::Residue;

constexpr Eigen::Index minors_up_to = 8;  // 2ⁿ minors: 256 of them
constexpr Eigen::Index cramer_up_to = 4;  // readable quotients of determinants

void require_square(const MatX& a) {
  if (a.rows() != a.cols()) throw Error(text("the matrix must be square, not ", a.rows(), "×", a.cols()));
}

/// Does the matrix consist of numbers without symbols, some of them irrational?
bool is_numeric(const MatX& a) {
  for (Expr leaf : leaves(entries(a)))
    if (symbol_of(leaf).kind != Kind::constant) return false;
  return !is_rational(a);
}

/// "A v = 0 for v = (2, -1)", or the dependent columns if v is long.
std::string dependency(const MatX& a) {
  const auto v = null_vector(a);
  if (!v) return "its columns depend on each other";
  constexpr std::size_t readable = 160;  // characters: two lines of a terminal
  if (const std::string shown = vector_to_text(*v); shown.size() <= readable)
    return "A v = 0 for v = " + shown;
  std::string columns;
  for (Eigen::Index j = 0; j < v->size(); ++j)
    if (!(*v)[j].is_zero()) columns += text(columns.empty() ? "" : ", ", j + 1);
  return "its columns " + columns + " depend on each other";
}

[[noreturn]] void singular(const MatX& a) {
  throw Error(text("the matrix is singular",
                   is_rational(a) || is_numeric(a) ? "" : " for all values of its symbols", ": ",
                   dependency(a)));
}

// ── determinants by minors ──

/// Minors of the last rows: det(k, columns) of rows k..n-1 and the columns in the set, each computed once.
class Minors {
 public:
  explicit Minors(const MatX& a) : a_(a) {}

  Expr of(Eigen::Index k, unsigned columns) {
    if (columns == 0) return 1;
    const auto [it, made] = known_.try_emplace(columns);
    if (!made) return it->second;
    Expr sum = 0;
    int position = 0;
    for (Eigen::Index j = 0; j < a_.cols(); ++j) {
      if (!(columns >> j & 1)) continue;
      const bool negative = position++ % 2 == 1;
      if (a_(k, j).is_zero()) continue;
      const Expr term = a_(k, j) * of(k + 1, columns & ~(1u << j));
      sum = negative ? sum - term : sum + term;
    }
    return known_[columns] = sum;
  }

 private:
  const MatX& a_;
  std::unordered_map<unsigned, Expr> known_;  // the number of columns determines the first row of the minor
};

Expr determinant_by_minors(const MatX& a) { return Minors(a).of(0, (1u << a.cols()) - 1); }

/// adj(a): the transposed matrix of cofactors.
MatX adjugate(const MatX& a) {
  const Eigen::Index n = a.rows();
  MatX adj(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      MatX minor(n - 1, n - 1);
      for (Eigen::Index r = 0; r < n - 1; ++r)
        for (Eigen::Index c = 0; c < n - 1; ++c) minor(r, c) = a(r < i ? r : r + 1, c < j ? c : c + 1);
      const Expr det = simplify(determinant_by_minors(minor));
      adj(j, i) = (i + j) % 2 == 0 ? det : -det;
    }
  return adj;
}

// ── elimination on the graph, guided by a random point ──

/// [a | …] with the value of every entry at a random point; entries with value zero are zero.
class Elimination {
 public:
  Elimination(MatX a, std::vector<Residue> values)
      : a_(std::move(a)), values_(std::move(values)), numbers_(is_numeric(a_)) {
    drop_zeros();
  }

  /// Gauss–Jordan in the first `columns` columns. Returns the column of each pivot.
  std::vector<Eigen::Index> run(Eigen::Index columns) {
    std::vector<Eigen::Index> pivots;
    for (Eigen::Index c = 0; c < columns; ++c) {
      const auto row = static_cast<Eigen::Index>(pivots.size());
      const Eigen::Index best = pivot_row(row, c);
      if (best < 0) continue;
      exchange(row, best);
      sign_ = row == best ? sign_ : -sign_;
      clear_column(row, c);
      pivots.push_back(c);
    }
    return pivots;
  }

  const MatX& matrix() const { return a_; }
  const std::vector<Expr>& pivots() const { return pivots_; }
  int sign() const { return sign_; }

 private:
  Residue& value(Eigen::Index i, Eigen::Index j) { return values_[j * a_.rows() + i]; }

  /// Does an entry vanish? Also by identities of roots and functions of numbers, such as √2 √3 = √6, which
  /// residues do not represent: such an entry is zero if it cancels to rounding.
  bool vanishes(Expr e, Residue residue) const {
    return residue.is_zero() || (numbers_ && !e.is_constant() && generic::is_zero(e));
  }

  void drop_zeros() {
    for (Eigen::Index k = 0; k < a_.size(); ++k)
      if (vanishes(a_.data()[k], values_[k])) {
        a_.data()[k] = 0;
        values_[k] = Residue{};
      }
  }

  /// The pivot row: numbers before expressions, then the row with the fewest entries (least
  /// fill, as Markowitz).
  Eigen::Index pivot_row(Eigen::Index first, Eigen::Index c) {
    Eigen::Index best = -1, best_cost = 0;
    for (Eigen::Index i = first; i < a_.rows(); ++i) {
      if (value(i, c).is_zero()) continue;
      Eigen::Index cost = a_(i, c).is_constant() ? 0 : a_.cols();
      for (Eigen::Index j = c; j < a_.cols(); ++j) cost += !a_(i, j).is_zero();
      if (best < 0 || cost < best_cost) {
        best = i;
        best_cost = cost;
      }
    }
    return best;
  }

  void exchange(Eigen::Index i, Eigen::Index k) {
    if (i == k) return;
    a_.row(i).swap(a_.row(k));
    for (Eigen::Index j = 0; j < a_.cols(); ++j) std::swap(value(i, j), value(k, j));
  }

  void clear_column(Eigen::Index r, Eigen::Index c) {
    const Expr pivot = a_(r, c);
    const Residue pivot_value = value(r, c);
    pivots_.push_back(pivot);
    for (Eigen::Index j = c; j < a_.cols(); ++j) {
      if (a_(r, j).is_zero()) continue;
      a_(r, j) /= pivot;
      value(r, j) = value(r, j) / pivot_value;
    }
    for (Eigen::Index i = 0; i < a_.rows(); ++i) {
      if (i == r || a_(i, c).is_zero()) continue;
      poll_interrupt();
      const Expr factor = a_(i, c);
      const Residue factor_value = value(i, c);
      for (Eigen::Index j = c; j < a_.cols(); ++j) {
        if (a_(r, j).is_zero()) continue;
        value(i, j) = value(i, j) - factor_value * value(r, j);
        a_(i, j) = value(i, j).is_zero() ? Expr(0) : a_(i, j) - factor * a_(r, j);
        if (vanishes(a_(i, j), value(i, j))) {
          a_(i, j) = 0;
          value(i, j) = Residue{};
        }
      }
      a_(i, c) = 0;
      value(i, c) = Residue{};
    }
  }

  MatX a_;
  std::vector<Residue> values_;
  std::vector<Expr> pivots_;
  int sign_ = 1;
  bool numbers_;  ///< there are no symbols but π
};

struct Reduced {
  MatX matrix;
  std::vector<Eigen::Index> pivot_columns;
  std::vector<Expr> pivots;
  int sign;
};

Reduced reduce(const MatX& a, Eigen::Index columns) {
  Elimination elimination(a, generic::residues(entries(a)));
  const auto pivots = elimination.run(columns);
  return {elimination.matrix(), pivots, elimination.pivots(), elimination.sign()};
}

MatX side_by_side(const MatX& a, const MatX& b) {
  MatX all(a.rows(), a.cols() + b.cols());
  all << a, b;
  return all;
}

}  // namespace

bool is_rational(const MatX& a) {
  const auto all = entries(a);
  return std::all_of(all.begin(), all.end(), [](Expr e) { return exact_value(e) != nullptr; });
}

int rank(const MatX& a) {
  if (!is_rational(a)) return static_cast<int>(reduce(a, a.cols()).pivot_columns.size());
  std::vector<mpq_class> scale;
  return static_cast<int>(
      rational::eliminate(rational::integer_rows(a, scale), static_cast<int>(a.cols())).pivot_column.size());
}

Expr determinant(const MatX& a) {
  require_square(a);
  const auto n = static_cast<std::size_t>(a.rows());
  if (is_rational(a)) {
    std::vector<mpq_class> scale;
    const rational::Echelon e = rational::eliminate(rational::integer_rows(a, scale), static_cast<int>(n));
    if (e.pivot_column.size() < n) return 0;
    mpq_class det = mpq_class(e.pivot) * e.sign;
    for (const mpq_class& factor : scale) det /= factor;
    return Expr(det);
  }
  if (a.rows() <= minors_up_to) {
    const Expr det = determinant_by_minors(a);
    return is_numeric(a) && generic::is_zero(det) ? Expr(0) : det;
  }
  const Reduced reduced = reduce(a, a.cols());
  if (reduced.pivot_columns.size() < n) return 0;
  Expr det = reduced.sign;
  for (Expr pivot : reduced.pivots) det *= pivot;
  return det;
}

MatX solve(const MatX& a, const MatX& b) {
  require_square(a);
  if (a.rows() != b.rows())
    throw Error(text("the matrix has ", a.rows(), " rows but the right-hand side has ", b.rows()));
  if (is_rational(a) && is_rational(b)) {
    auto x = rational::solve(a, b);
    if (!x) singular(a);
    return std::move(*x);
  }
  if (a.rows() == 0) return b;
  if (a.rows() <= cramer_up_to) {
    const Expr det = simplify(determinant_by_minors(a));
    if (generic::is_zero(det)) singular(a);
    const MatX adj = adjugate(a);
    MatX x(b.rows(), b.cols());
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      for (Eigen::Index j = 0; j < x.cols(); ++j) {
        Expr numerator = 0;
        for (Eigen::Index k = 0; k < a.cols(); ++k) numerator += adj(i, k) * b(k, j);
        x(i, j) = simplify(numerator / det);
      }
    return x;
  }
  const Reduced reduced = reduce(side_by_side(a, b), a.cols());
  if (static_cast<Eigen::Index>(reduced.pivot_columns.size()) < a.rows()) singular(a);
  return reduced.matrix.rightCols(b.cols());
}

MatX inverse(const MatX& a) {
  require_square(a);
  return solve(a, MatX::Identity(a.rows(), a.cols()));
}

std::optional<VecX> null_vector(const MatX& a) {
  const auto columns = static_cast<int>(a.cols());
  if (is_rational(a)) {
    std::vector<mpq_class> scale;
    return rational::null_vector(rational::eliminate(rational::integer_rows(a, scale), columns), columns);
  }
  const Reduced reduced = reduce(a, a.cols());
  const auto& pivots = reduced.pivot_columns;
  Eigen::Index free_column = 0;
  while (free_column < static_cast<Eigen::Index>(pivots.size()) && pivots[free_column] == free_column)
    ++free_column;
  if (free_column == a.cols()) return {};
  VecX v = VecX::Zero(a.cols());
  v[free_column] = 1;
  for (std::size_t i = 0; i < pivots.size(); ++i)
    v[pivots[i]] = -reduced.matrix(static_cast<Eigen::Index>(i), free_column);
  // nodes in all: a choice, as simplify takes longer than the elimination
  constexpr std::size_t readable = 500;
  if (topological(entries(v)).size() > readable) return v;
  for (Expr& e : v) e = simplify(e);
  return v;
}

VecX characteristic(const MatX& a) {
  require_square(a);
  const Eigen::Index n = a.rows();
  VecX c(n + 1);
  if (is_rational(a)) {
    const auto exact = rational::characteristic(a);
    for (Eigen::Index k = 0; k <= n; ++k) c[k] = Expr(exact[k]);
    return c;
  }
  // (-1)ᵏcₖ is the sum of the principal minors of order k, without divisions or cancellation.
  // 2ⁿ principal minors: full symbolic matrices take 6 s for 8, 112 s for 10
  constexpr Eigen::Index most_rows = 10;
  if (n > most_rows)
    throw Error(text("the symbolic matrix has ", n, " rows, at most ", most_rows,
                     " are possible; give its symbols values with subs"));
  c.setZero();
  c[0] = 1;
  for (unsigned set = 1; set < 1u << n; ++set) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < n; ++i)
      if (set >> i & 1) rows.push_back(i);
    poll_interrupt();
    const Expr minor = determinant(MatX(a(rows, rows)));
    const auto order = static_cast<Eigen::Index>(rows.size());
    c[order] = order % 2 == 0 ? c[order] + minor : c[order] - minor;
  }
  for (Expr& e : c) e = simplify(e);
  return c;
}

MatX implicit_jacobian(std::span<const Expr> r, std::span<const Expr> z, std::span<const Expr> y) {
  if (r.size() != z.size())
    throw Error(text("r has ", r.size(), r.size() == 1 ? " equation" : " equations", " but z has ", z.size(),
                     z.size() == 1 ? " unknown" : " unknowns", ": give one equation per unknown"));
  if (r.empty()) throw Error("r is empty; give the equations r(y, z) = 0 that determine z");
  const MatX rz = jacobian(r, z);
  try {
    return solve(rz, -jacobian(r, y));
  } catch (const Error& e) {
    throw Error(
        text("∂r/∂z is not regular, so r(y, z) = 0 does not determine z near a point (", e.what(), ")"));
  }
}

}  // namespace pendula::linalg
