#include "codegen/linear/pivots.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/epsilon.hpp"

namespace pendula::codegen {
namespace {

/// The numbers are stored in a square array, but lists of the entries are searched, so that the cost is that
/// of the fill. The best pivot of every column is cached until an entry in its rows changes.
class Markowitz {
 public:
  Markowitz(int n, std::vector<std::complex<double>> A, std::vector<char> entry, double threshold)
      : n_(n), a_(std::move(A)), entry_(std::move(entry)), threshold_(threshold) {
    const auto size = static_cast<std::size_t>(n);
    rows_.resize(size);
    columns_.resize(size);
    scale_.assign(size, 0);
    row_count_.assign(size, 0);
    column_count_.assign(size, 0);
    row_done_.assign(size, 0);
    column_done_.assign(size, 0);
    best_.resize(size);
    stale_.assign(size, 0);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        if (has(i, j)) add(i, j);
  }

  std::optional<Elimination> run() {
    for (int i = 0; i < n_; ++i) {
      for (int j : rows_[at(i)]) scale_[at(i)] = std::max(scale_[at(i)], std::abs(a(i, j)));
      if (!(scale_[at(i)] > 0) || !std::isfinite(scale_[at(i)])) return {};
      scale_[at(i)] = 1 / scale_[at(i)];
    }
    for (int j = 0; j < n_; ++j) best_[at(j)] = best_of(j);
    for (int k = 0; k < n_; ++k) {
      const Candidate chosen = best();
      if (chosen.row < 0) return {};
      const int j = chosen.column;
      order_.row.push_back(chosen.row);
      order_.column.push_back(j);
      eliminate(chosen.row, j);
    }
    collect();
    return std::move(order_);
  }

 private:
  struct Candidate {
    int row = -1, column = -1;
    long cost = std::numeric_limits<long>::max();
    double size = 0;
    /// Prefers fewer updates, then a larger pivot, then the first.
    bool operator<(const Candidate& other) const {
      return cost != other.cost   ? cost < other.cost
             : size != other.size ? size > other.size
                                  : row < other.row;
    }
  };

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  std::complex<double>& a(int i, int j) { return a_[at(i) * at(n_) + at(j)]; }
  char& has(int i, int j) { return entry_[at(i) * at(n_) + at(j)]; }
  void add(int i, int j) {
    rows_[at(i)].push_back(j);
    columns_[at(j)].push_back(i);
    ++row_count_[at(i)];
    ++column_count_[at(j)];
  }
  double scaled(int i, int j) { return std::abs(a(i, j)) * scale_[at(i)]; }

  /// The best pivot of a column; without a row if the column is zero to within rounding.
  Candidate best_of(int j) {
    double largest = 0;
    for (int i : columns_[at(j)])
      if (!row_done_[at(i)]) largest = std::max(largest, scaled(i, j));
    Candidate found;
    if (!(largest > n_ * eps * eps)) return found;
    for (int i : columns_[at(j)]) {
      if (row_done_[at(i)]) continue;
      const double size = scaled(i, j);
      if (size < threshold_ * largest) continue;
      const Candidate next{i, j, static_cast<long>(row_count_[at(i)] - 1) * (column_count_[at(j)] - 1), size};
      if (found.row < 0 || next < found) found = next;
    }
    return found;
  }

  Candidate best() {
    Candidate found;
    for (int j = 0; j < n_; ++j) {
      if (column_done_[at(j)]) continue;
      const Candidate& c = best_[at(j)];
      if (c.row < 0) return {};
      if (c.cost < found.cost || (c.cost == found.cost && c.size > found.size)) found = c;
    }
    return found;
  }

  void eliminate(int pivot_row, int pivot_column) {
    row_done_[at(pivot_row)] = column_done_[at(pivot_column)] = 1;
    std::vector<int> changed;  // columns
    const auto change = [&](int j) {
      if (!column_done_[at(j)] && !stale_[at(j)]) {
        stale_[at(j)] = 1;
        changed.push_back(j);
      }
    };
    for (int j : rows_[at(pivot_row)]) --column_count_[at(j)], change(j);
    for (int i : columns_[at(pivot_column)]) {
      if (row_done_[at(i)]) continue;
      --row_count_[at(i)];
      const std::complex<double> factor = a(i, pivot_column) / a(pivot_row, pivot_column);
      for (int j : rows_[at(pivot_row)]) {
        if (column_done_[at(j)]) continue;
        if (!has(i, j)) {
          has(i, j) = 1;
          add(i, j);
        }
        a(i, j) -= factor * a(pivot_row, j);
      }
      for (int j : rows_[at(i)]) change(j);
    }
    for (int j : changed) {
      best_[at(j)] = best_of(j);
      stale_[at(j)] = 0;
    }
  }

  void collect() {
    std::vector<int> number(at(n_));
    for (int k = 0; k < n_; ++k) number[at(order_.column[at(k)])] = k;
    for (int k = 0; k < n_; ++k) {
      auto &lower = order_.lower.emplace_back(), &upper = order_.upper.emplace_back();
      for (int j : rows_[at(order_.row[at(k)])]) {
        const int other = number[at(j)];
        if (other < k) lower.push_back(other);
        if (other > k) upper.push_back(other);
      }
      std::sort(lower.begin(), lower.end());
      std::sort(upper.begin(), upper.end());
    }
  }

  int n_;
  std::vector<std::complex<double>> a_;
  std::vector<char> entry_, row_done_, column_done_, stale_;
  double threshold_;
  std::vector<std::vector<int>> rows_, columns_;  ///< positions of all entries, finished rows included
  std::vector<int> row_count_, column_count_;     ///< without finished columns; without finished rows
  std::vector<Candidate> best_;                   ///< by column
  std::vector<double> scale_;
  Elimination order_;
};

}  // namespace

std::optional<Elimination> choose_pivots(int n, std::vector<std::complex<double>> A, std::vector<char> entry,
                                         double threshold) {
  return Markowitz(n, std::move(A), std::move(entry), threshold).run();
}

}  // namespace pendula::codegen
