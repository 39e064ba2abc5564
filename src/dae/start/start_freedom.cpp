// The freedom that equations and fixes leave at a point: ranks by orthogonal decompositions, in large systems
// by sparse elimination with the columns divided into classes.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/decompositions.hpp"
#include "base/interrupt.hpp"
#include "dae/newton/block_solution.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/start/start_system.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;
using Sparse = Eigen::SparseMatrix<double>;

constexpr double independent_at_double_root = 1e-5;  // the point, hence J, is known to √ε = 1.5e-8 there
constexpr double movable = 1e-8;                     // part of a unit direction that counts as motion

/// An orthonormal basis of the rows seen so far.
class RowSpace {
 public:
  RowSpace(Mat rows, double threshold) : basis_(rows.cols(), rows.cols()), threshold_(threshold) {
    for (Index i = 0; i < rows.rows(); ++i)
      if (const double size = rows.row(i).norm(); size > 0) rows.row(i) /= size;
    Eigen::ColPivHouseholderQR<Mat> qr;
    qr.setThreshold(threshold_);
    qr.compute(Mat(rows.transpose()));
    rank_ = rows.rows() ? qr.rank() : 0;
    if (rank_) basis_.leftCols(rank_) = thin_q(qr.householderQ(), rank_);
  }

  Index rank() const { return rank_; }

  /// False if the row is a combination of those before.
  bool add(Vec row) {
    const double size = row.norm();
    if (size == 0 || rank_ == basis_.cols()) return false;
    row /= size;
    for (int twice = 0; twice < 2; ++twice)
      row -= basis_.leftCols(rank_) * (basis_.leftCols(rank_).transpose() * row);
    if (row.norm() <= threshold_) return false;
    basis_.col(rank_++) = row.normalized();
    return true;
  }

  /// Orthonormal directions orthogonal to all rows.
  Mat complement() const {
    const Index n = basis_.rows();
    if (rank_ == 0) return Mat::Identity(n, n);
    if (rank_ == n) return Mat(n, 0);
    const Eigen::HouseholderQR<Mat> qr(Mat(basis_.leftCols(rank_)));
    return full_q(qr.householderQ()).rightCols(n - rank_);
  }

 private:
  Mat basis_;
  double threshold_;
  Index rank_ = 0;
};

/// Rows of N that determine all its columns; of nearly equal rows the first.
std::vector<Index> pivots(Mat N, const std::vector<Index>& candidates) {
  constexpr double nearly = 0.7;  // a longer row within 3 dB does not replace an earlier one
  Mat M(static_cast<Index>(candidates.size()), N.cols());
  for (Index k = 0; k < M.rows(); ++k) M.row(k) = N.row(candidates[k]);
  Eigen::ColPivHouseholderQR<Mat> qr;
  qr.setThreshold(movable);
  qr.compute(M);
  Mat Q = thin_q(qr.householderQ(), qr.rank());
  std::vector<Index> chosen;
  for (Index step = 0; step < qr.rank(); ++step) {
    const Vec norms = Q.rowwise().norm();
    Index pick = 0;
    while (norms[pick] < nearly * norms.maxCoeff()) ++pick;
    chosen.push_back(candidates[pick]);
    const Vec direction = Q.row(pick).transpose() / norms[pick];
    Q -= (Q * direction) * direction.transpose();
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

/// Scales down the columns of fixed unknowns that hide the other entries of a row: the column of a stiff
/// spring whose deflection is fixed at 0 hides the entries of accelerations in the row. The rank does not
/// change. Skipped if the other entries are rounding errors.
void uncover(const StartSystem& s, Mat& J) {
  constexpr double noise = 1e-14;  // 45 ε
  const std::vector<char> fixed = s.fixed();
  auto equations = J.topRows(static_cast<Index>(s.first_fix));
  Vec others = Vec::Zero(equations.rows());
  for (Index j = 0; j < J.cols(); ++j)
    if (!fixed[j]) others = others.cwiseMax(equations.col(j).cwiseAbs());
  for (Index j = 0; j < J.cols(); ++j) {
    if (!fixed[j]) continue;
    double factor = 1;
    for (Index i = 0; i < equations.rows(); ++i)
      if (others[i] > noise * std::fabs(equations(i, j)) && equations(i, j) != 0)
        factor = std::min(factor, others[i] / std::fabs(equations(i, j)));
    equations.col(j) *= factor;
  }
}

/// Is J square and clearly regular? For rows of unit length the distance of row i from the span of the others
/// is 1/‖J⁻¹ eᵢ‖.
bool is_plainly_regular(Mat J) {
  // well above the thresholds 1e-9 and, at double roots (which do not get here), 1e-5
  constexpr double far = 1e-6;
  if (J.rows() != J.cols() || J.rows() == 0) return false;
  const Vec length = J.rowwise().norm();
  if (!(length.minCoeff() > 0)) return false;
  J = length.cwiseInverse().asDiagonal() * J;
  const Eigen::PartialPivLU<Mat> lu(J);
  const Mat inverse = lu.solve(Mat::Identity(J.rows(), J.cols()));
  return inverse.allFinite() && inverse.colwise().norm().maxCoeff() < 1 / far;
}

/// The freedom of a square system that determines all unknowns.
Freedom regular_freedom(const StartSystem& s) {
  Freedom f;
  f.rank_equations = static_cast<int>(s.first_fix);
  f.redundant.assign(s.fixes(), 0);
  f.chosen.assign(s.unknowns.size(), 0);
  f.undetermined.resize(static_cast<Index>(s.unknowns.size()), 0);
  return f;
}

Freedom dense_freedom(const StartSystem& s, Mat J, double threshold) {
  uncover(s, J);
  if (threshold <= independent_row && is_plainly_regular(J)) return regular_freedom(s);
  Freedom f;
  const auto first = static_cast<Index>(s.first_fix), n = J.cols();
  RowSpace space(J.topRows(first), threshold);
  f.rank_equations = static_cast<int>(space.rank());
  for (std::size_t k = 0; k < s.fixes(); ++k)
    f.redundant.push_back(!space.add(J.row(first + static_cast<Index>(k)).transpose()));
  const auto& covered = s.guessed();
  const bool any = std::find(covered.begin(), covered.end(), 1) != covered.end();
  const Mat left = any ? space.complement() : Mat();
  f.chosen.assign(s.unknowns.size(), 0);
  for (Index j = 0; j < n; ++j) {
    if (!covered[j]) continue;
    const bool adds = space.add(Vec::Unit(n, j));  // a guessed multiplier may follow from guessed states
    const bool free = adds || j < static_cast<Index>(s.state_count);
    f.chosen[j] = free && left.cols() && left.row(j).norm() > movable;
  }
  f.undetermined = space.complement();
  f.count = static_cast<int>(f.undetermined.cols());
  if (!f.count) return f;
  for (Index j = 0; j < n; ++j)
    if (f.undetermined.row(j).norm() > movable) f.open.push_back(j);
  std::vector<Index> states;
  for (Index j : f.open)
    if (j < static_cast<Index>(s.state_count)) states.push_back(j);
  f.recommended = pivots(f.undetermined, states);
  if (static_cast<int>(f.recommended.size()) == f.count)
    f.open = states;
  else
    f.recommended = pivots(f.undetermined, f.open);
  return f;
}

/// Gaussian elimination on rows of unit size that takes pivots in the columns of one class after the other.
/// The next pivot is the cheapest entry of a shortest row or column by (entries of the row - 1)·(rows of
/// the column - 1) (Markowitz 1957), with threshold pivoting. A column with one row, as at the end of a
/// chain, costs nothing.
class ClassedElimination {
 public:
  ClassedElimination(const Sparse& J, Index rows, std::vector<int> column_class)
      : class_(std::move(column_class)), rows_(static_cast<std::size_t>(rows)), columns_(class_.size()) {
    for (Index j = 0; j < J.outerSize(); ++j)
      for (Sparse::InnerIterator it(J, j); it; ++it)
        if (it.row() < rows && it.value() != 0) {
          rows_[at(it.row())][j] = it.value();
          columns_[at(j)].insert(it.row());
        }
    for (auto& row : rows_) {
      double largest = 0;
      for (const auto& [j, v] : row) largest = std::max(largest, std::fabs(v));
      for (auto& [j, v] : row) v /= largest;
    }
    active_.assign(rows_.size(), 1);
  }

  /// Eliminates the columns of class c; returns those without a pivot.
  std::vector<Index> eliminate(int c) {
    now_ = c;
    short_rows_ = Queue(rows_.size());
    short_columns_ = Queue(class_.size());
    for (std::size_t i = 0; i < rows_.size(); ++i)
      if (active_[i]) update_row(static_cast<Index>(i));
    for (std::size_t j = 0; j < class_.size(); ++j) update_column(static_cast<Index>(j));
    std::vector<char> has_pivot(class_.size(), 0);
    while (!short_rows_.empty()) {
      poll_interrupt();
      const auto [p, column] = cheapest();
      has_pivot[at(column)] = 1;
      ++rank;
      active_[at(p)] = 0;
      short_rows_.put(p, 0);
      for (const auto& [j, v] : rows_[at(p)]) {
        columns_[at(j)].erase(p);
        update_column(j);
      }
      const auto others = columns_[at(column)];
      for (Index i : others) {
        subtract(p, i, column);
        update_row(i);
      }
    }
    std::vector<Index> left;
    for (std::size_t j = 0; j < class_.size(); ++j)
      if (class_[j] == c && !has_pivot[j]) left.push_back(static_cast<Index>(j));
    return left;
  }

  int rank = 0;

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }

  /// The numbers 0 … n-1 by size, without those of size 0.
  class Queue {
   public:
    explicit Queue(std::size_t n = 0) : size_(n, 0) {}
    void put(Index i, std::size_t size) {
      std::size_t& before = size_[at(i)];
      if (before == size) return;
      if (before) order_.erase({before, i});
      if (size) order_.insert({size, i});
      before = size;
    }
    bool empty() const { return order_.empty(); }
    Index first() const { return order_.begin()->second; }

   private:
    std::set<std::pair<std::size_t, Index>> order_;
    std::vector<std::size_t> size_;
  };

  void update_row(Index i) {
    std::size_t k = 0;
    for (const auto& [j, v] : rows_[at(i)]) k += class_[at(j)] == now_;
    short_rows_.put(i, k);
  }
  void update_column(Index j) {
    if (class_[at(j)] == now_) short_columns_.put(j, columns_[at(j)].size());
  }

  /// The largest entry of the class in the row.
  double largest(Index p) const {
    double most = 0;
    for (const auto& [j, v] : rows_[at(p)])
      if (class_[at(j)] == now_) most = std::max(most, std::fabs(v));
    return most;
  }
  std::size_t cost(Index p, Index column) const {
    return (rows_[at(p)].size() - 1) * (columns_[at(column)].size() - 1);
  }

  /// The cheaper of two candidates: a large enough entry of the shortest row, in the shortest column; and an
  /// entry of the shortest column that is large enough in its row, in the shortest row.
  std::pair<Index, Index> cheapest() const {
    constexpr double threshold = 0.1;  // usual for sparse LU: Duff, Erisman & Reid 2017
    const Index p = short_rows_.first();
    std::pair<Index, Index> best{p, -1};
    const double most = largest(p);
    for (const auto& [j, v] : rows_[at(p)]) {
      if (class_[at(j)] != now_ || std::fabs(v) < threshold * most) continue;
      if (best.second < 0 || columns_[at(j)].size() < columns_[at(best.second)].size()) best.second = j;
    }
    const Index column = short_columns_.first();
    for (Index i : columns_[at(column)])
      if (cost(i, column) < cost(best.first, best.second) &&
          std::fabs(rows_[at(i)].at(column)) >= threshold * largest(i))
        best = {i, column};
    return best;
  }

  void subtract(Index p, Index i, Index column) {
    constexpr double rounding = 1e-11;  // relative to the terms that cancel
    constexpr double least = 1e-3;      // in units: entries below 1e-14 are rounding, whatever their terms
    auto& row = rows_[at(i)];
    const auto& pivot = rows_[at(p)];
    const double factor = row.at(column) / pivot.at(column);
    for (const auto& [j, v] : pivot) {
      const auto [it, made] = row.try_emplace(j, 0);
      const double before = std::fabs(it->second);
      it->second -= factor * v;
      if (j == column ||
          std::fabs(it->second) <= rounding * std::max({before, std::fabs(factor * v), least})) {
        row.erase(it);
        columns_[at(j)].erase(i);
        update_column(j);
      } else if (made) {
        columns_[at(j)].insert(i);
        update_column(j);
      }
    }
  }

  int now_ = 0;  ///< the class being eliminated
  std::vector<int> class_;
  std::vector<std::map<Index, double>> rows_;
  std::vector<std::set<Index>> columns_;  ///< active rows only
  std::vector<char> active_;
  Queue short_rows_, short_columns_;
};

}  // namespace

Freedom sparse_freedom(const StartSystem& s, const Sparse& J) {
  enum { computed, state, guessed, fixed };  // pivots are taken in this order
  const std::size_t n = s.unknowns.size();
  std::vector<int> classes(n, computed);
  for (std::size_t j = 0; j < s.state_count; ++j) classes[j] = state;
  const auto& covered = s.guessed();
  for (std::size_t j = 0; j < n; ++j)
    if (covered[j]) classes[j] = guessed;
  // A fix of an expression in several unknowns is an equation like the others.
  Freedom f;
  f.redundant.assign(s.fixes(), 0);
  std::map<Index, std::size_t> fix_of;
  for (std::size_t k = 0; k < s.fixes(); ++k)
    if (const auto j = s.fixed_unknown(k)) {
      if (fix_of.count(*j)) f.redundant[k] = 1;
      fix_of.emplace(*j, k);
      classes[*j] = fixed;
    }
  ClassedElimination e(J, static_cast<Index>(s.first_fix), classes);
  f.chosen.assign(n, 0);
  for (int c : {computed, state})
    for (Index j : e.eliminate(c)) f.open.push_back(j);
  for (Index j : e.eliminate(guessed)) f.chosen[j] = 1;
  const std::vector<Index> independent_fixes = e.eliminate(fixed);
  const std::set<Index> needed(independent_fixes.begin(), independent_fixes.end());
  for (const auto& [j, k] : fix_of) f.redundant[k] = f.redundant[k] || !needed.count(j);
  f.rank_equations = e.rank;
  f.count = static_cast<int>(f.open.size());
  f.recommended = f.open;
  return f;
}

/// Column factors that scale the largest entries of all rows and columns to 1.
static Vec column_scales(Mat J) { return divide_by_largest(J).columns.cwiseInverse(); }

/// Does every level (levels_of) determine its new unknowns, given their fixes and guesses? Then nothing is
/// open, whatever the rounding errors of all levels together. docs/derivations.md#start.
static bool is_determined_by_levels(const StartSystem& s, const Mat& J) {
  const StartLevels& levels = levels_of(s);
  if (levels.highest < StartLevels::high) return false;
  std::vector<char> given = s.fixed();
  const auto& guessed = s.guessed();
  for (std::size_t j = 0; j < given.size(); ++j) given[j] = given[j] || guessed[j];
  for (int level = 0; level <= levels.highest + 1; ++level) {
    std::vector<Index> rows, columns;
    for (std::size_t i = 0; i < s.first_fix; ++i)
      if (levels.of_row[i] == level) rows.push_back(static_cast<Index>(i));
    for (std::size_t j = 0; j < given.size(); ++j)
      if (levels.of_unknown[j] == level && !given[j]) columns.push_back(static_cast<Index>(j));
    if (rank_with_gap(J(rows, columns)).rank < static_cast<int>(columns.size())) return false;
  }
  return true;
}

/// The freedom in units of the unknowns and, if that leaves something open, after equilibration as well: the
/// tenth derivative of an equation has entries between 1 and 10⁹.
static Freedom small_freedom(const StartSystem& s, const Mat& J, double threshold) {
  Freedom f = dense_freedom(s, J, threshold);
  if (f.count == 0) return f;
  const Vec scale = column_scales(J);
  Freedom other = dense_freedom(s, J * scale.asDiagonal(), threshold);
  if (other.count > 0 && is_determined_by_levels(s, J)) {
    other.count = 0;
    other.rank_equations = static_cast<int>(s.first_fix);
    other.undetermined.resize(J.cols(), 0);
    return other;
  }
  if (other.count >= f.count) return f;
  other.undetermined = (scale.asDiagonal() * other.undetermined).colwise().normalized();
  return other;
}

/// Is every block of the square Jacobian clearly regular, counting only entries with a small relative error?
/// An entry that changes within the accuracy of the solution may be 0 at the exact one.
static bool has_regular_blocks(const StartSystem& s, const Vec& w, Mat J) {
  constexpr double known = 1e-9;    // relative accuracy of a solution: typed_accuracy
  constexpr double accurate = 0.1;  // relative change of an entry that has its first digit
  if (J.rows() != J.cols()) return false;
  Vec beside = w;
  for (Index j = 0; j < w.size(); ++j) {
    const double sign = std::fmod(static_cast<double>(j + 1) * golden_fraction, 1.0) < 0.5 ? -1 : 1;
    beside[j] += sign * known * std::max(std::fabs(w[j]), s.unit[j]);
  }
  const Mat other(s.jacobian(beside));
  if (!other.allFinite()) return false;
  J = (other - J)
          .cwiseAbs()
          .cwiseQuotient(J.cwiseAbs())
          .unaryExpr([](double change) { return change <= accurate ? 1.0 : 0.0; })
          .cwiseProduct(J);
  return solve_by_blocks(J, Vec::Ones(J.rows())).has_value();
}

static Freedom first_order_freedom(const StartSystem& s, const Vec& w, bool slow) {
  Sparse J = s.jacobian(w);
  for (Index k = 0; k < J.nonZeros(); ++k)  // √x at a fixed 0: only the occurrence of x matters
    if (!std::isfinite(J.valuePtr()[k])) J.valuePtr()[k] = 1;
  if (w.size() > dense_up_to) return sparse_freedom(s, J);
  if (slow) return small_freedom(s, Mat(J), independent_at_double_root);
  Freedom f = small_freedom(s, Mat(J), independent_row);
  const bool open = f.count > 0 || std::find(f.redundant.begin(), f.redundant.end(), 1) != f.redundant.end();
  return open && has_regular_blocks(s, w, Mat(J)) ? regular_freedom(s) : f;
}

Freedom freedom(const StartSystem& s, const Vec& w, bool slow) {
  Freedom f = first_order_freedom(s, w, slow);
  f.dimension = static_cast<int>(w.size()) - f.rank_equations;
  refine_by_curvature(s, w, slow ? independent_at_double_root : independent_row, f);
  return f;
}

}  // namespace pendula::dae
