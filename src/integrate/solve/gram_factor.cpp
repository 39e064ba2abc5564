#include "integrate/solve/gram_factor.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include "base/lru_cache.hpp"

namespace pendula::integrate {

GramFactor::GramFactor(int rows, int columns, const std::vector<Position>& positions)
    : rows_(rows), columns_(columns), positions_(positions), scaled_(positions.size()) {
  order(positions);
  std::vector<std::vector<int>> of_column(static_cast<std::size_t>(columns));
  for (std::size_t k = 0; k < positions.size(); ++k)
    of_column[positions[k].column].push_back(static_cast<int>(k));
  const auto place = [&](int entry) { return place_[positions_[entry].row]; };
  std::vector<std::vector<int>> below(static_cast<std::size_t>(rows));
  for (const auto& list : of_column)
    for (int a : list)
      for (int b : list)
        if (place(a) > place(b)) below[place(b)].push_back(place(a));
  fill(std::move(below));
  for (const auto& list : of_column)
    for (int a : list)
      for (int b : list)
        if (place(a) > place(b))
          pairs_.push_back({a, b, slot(place(a), place(b))});
        else if (a == b)
          pairs_.push_back({a, a, place(a)});
  values_.resize(static_cast<std::size_t>(rows) + entry_row_.size());
  right_.resize(static_cast<std::size_t>(rows));
}

GramFactor GramFactor::remembered(int rows, int columns, const std::vector<Position>& positions) {
  static std::mutex mutex;
  static LruCache<std::vector<int>, GramFactor, WordsHash, Refers::by_touch> known(16);
  std::vector<int> key{rows, columns};
  for (const Position& p : positions) {
    key.push_back(p.row);
    key.push_back(p.column);
  }
  const std::lock_guard lock(mutex);
  if (const GramFactor* found = known.find(key)) return *found;
  return known.insert(key, GramFactor(rows, columns, positions));
}

void GramFactor::order(const std::vector<Position>& positions) {
  using Matrix = Eigen::SparseMatrix<double>;
  std::vector<Eigen::Triplet<double>> ones;
  for (const Position& p : positions) ones.emplace_back(p.row, p.column, 1.0);
  Matrix G(rows_, columns_);
  G.setFromTriplets(ones.begin(), ones.end());
  const Matrix S = G * G.transpose();
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> list;
  Eigen::AMDOrdering<int>()(S.selfadjointView<Eigen::Lower>(), list);
  place_.resize(static_cast<std::size_t>(rows_));
  for (int k = 0; k < rows_; ++k) place_[list.indices()[k]] = k;
}

/// Computes the pattern of L and the targets of the updates by products of two entries of a column.
void GramFactor::fill(std::vector<std::vector<int>> below) {
  start_.assign(1, 0);
  for (std::size_t k = 0; k < below.size(); ++k) {
    std::vector<int>& column = below[k];
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    entry_row_.insert(entry_row_.end(), column.begin(), column.end());
    start_.push_back(static_cast<int>(entry_row_.size()));
    if (column.empty()) continue;
    auto& next = below[column[0]];  // the parent inherits the remaining rows
    next.insert(next.end(), column.begin() + 1, column.end());
  }
  for (const auto& column : below)
    for (std::size_t a = 0; a < column.size(); ++a) {
      target_.push_back(column[a]);
      for (std::size_t b = a + 1; b < column.size(); ++b) target_.push_back(slot(column[b], column[a]));
    }
}

/// The index of L(i, j), i > j.
int GramFactor::slot(int i, int j) const {
  const auto first = entry_row_.begin() + start_[j], last = entry_row_.begin() + start_[j + 1];
  return rows_ + static_cast<int>(std::lower_bound(first, last, i) - entry_row_.begin());
}

bool GramFactor::factorise(const double* given) {
  if (scale_.empty()) {
    scale_.assign(static_cast<std::size_t>(rows_), 0.0);
    for (std::size_t k = 0; k < positions_.size(); ++k) {
      double& size = scale_[positions_[k].row];
      size = std::hypot(size, given[k]);
    }
    for (double& s : scale_) s = s > 0 && std::isfinite(s) ? 1 / s : 1;
  }
  for (std::size_t k = 0; k < positions_.size(); ++k) scaled_[k] = given[k] * scale_[positions_[k].row];
  std::fill(values_.begin(), values_.end(), 0.0);
  for (const Pair& p : pairs_) values_[p.slot] += scaled_[p.a] * scaled_[p.b];
  constexpr double rounding = 1e-16;  // of a diagonal entry, which is 1 after scaling
  bool regular = true;
  double* v = values_.data();
  double* off = v + rows_;
  const int* target = target_.data();
  for (int k = 0; k < rows_; ++k) {
    if (!(v[k] > rounding)) {
      v[k] = rounding;
      regular = false;
    }
    const int end = start_[k + 1];
    for (int a = start_[k]; a < end; ++a) {
      const double factor = off[a] / v[k];
      for (int b = a; b < end; ++b) v[*target++] -= factor * off[b];
      off[a] = factor;
    }
  }
  return regular;
}

double GramFactor::least(Vec& u, Vec& w, int iterations) const {
  const double* off = values_.data() + rows_;
  std::vector<double>& y = right_;
  for (int it = 0; it < iterations; ++it) {
    for (int i = 0; i < rows_; ++i) y[place_[i]] = u[i];
    for (std::size_t k = 0; k < y.size(); ++k)
      for (int a = start_[k]; a < start_[k + 1]; ++a) y[entry_row_[a]] -= off[a] * y[k];
    for (std::size_t k = 0; k < y.size(); ++k) y[k] /= values_[k];
    for (std::size_t k = y.size(); k-- > 0;)
      for (int a = start_[k]; a < start_[k + 1]; ++a) y[k] -= off[a] * y[entry_row_[a]];
    double square = 0;
    for (double s : y) square += s * s;
    const double norm = std::sqrt(square);
    if (!(norm > 0) || !std::isfinite(norm)) break;
    for (int i = 0; i < rows_; ++i) u[i] = y[place_[i]] / norm;
  }
  w.setZero(columns_);
  for (std::size_t k = 0; k < positions_.size(); ++k)
    w[positions_[k].column] += scaled_[k] * u[positions_[k].row];
  return w.norm();
}

}  // namespace pendula::integrate
