#include "codegen/pivots.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pendula::codegen {
namespace {

class Markowitz {
 public:
  Markowitz(int n, std::vector<std::complex<double>> A, std::vector<char> entry, double threshold)
      : n_(n), a_(std::move(A)), entry_(std::move(entry)), threshold_(threshold) {
    const auto size = static_cast<std::size_t>(n);
    row_count_.assign(size, 0), column_count_.assign(size, 0);
    row_done_.assign(size, 0), column_done_.assign(size, 0);
    scale_.assign(size, 0);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        if (has(i, j)) ++row_count_[at(i)], ++column_count_[at(j)];
  }

  std::optional<Elimination> run() {
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < n_; ++j) scale_[at(i)] = std::max(scale_[at(i)], std::abs(a(i, j)));
      if (!(scale_[at(i)] > 0) || !std::isfinite(scale_[at(i)])) return {};
      scale_[at(i)] = 1 / scale_[at(i)];
    }
    for (int k = 0; k < n_; ++k) {
      const auto [i, j] = best();
      if (i < 0) return {};
      order_.row.push_back(i), order_.column.push_back(j), order_.row_scale.push_back(scale_[at(i)]);
      eliminate(i, j);
    }
    collect();
    return std::move(order_);
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  std::complex<double>& a(int i, int j) { return a_[at(i * n_ + j)]; }
  char& has(int i, int j) { return entry_[at(i * n_ + j)]; }

  std::pair<int, int> best() {
    std::pair<int, int> found{-1, -1};
    long least = std::numeric_limits<long>::max();
    double size_of_best = 0;
    for (int j = 0; j < n_; ++j) {
      if (column_done_[at(j)]) continue;
      double largest = 0;
      for (int i = 0; i < n_; ++i)
        if (!row_done_[at(i)] && has(i, j)) largest = std::max(largest, std::abs(a(i, j)) * scale_[at(i)]);
      if (!(largest > n_ * std::numeric_limits<double>::epsilon() * std::numeric_limits<double>::epsilon()))
        return {-1, -1};
      for (int i = 0; i < n_; ++i) {
        if (row_done_[at(i)] || !has(i, j)) continue;
        const double size = std::abs(a(i, j)) * scale_[at(i)];
        if (size < threshold_ * largest) continue;
        const long cost = static_cast<long>(row_count_[at(i)] - 1) * (column_count_[at(j)] - 1);
        if (cost < least || (cost == least && size > size_of_best))
          least = cost, size_of_best = size, found = {i, j};
      }
    }
    return found;
  }

  void eliminate(int pivot_row, int pivot_column) {
    row_done_[at(pivot_row)] = column_done_[at(pivot_column)] = 1;
    for (int j = 0; j < n_; ++j)
      if (has(pivot_row, j)) --column_count_[at(j)];
    for (int i = 0; i < n_; ++i) {
      if (row_done_[at(i)] || !has(i, pivot_column)) continue;
      --row_count_[at(i)];
      const std::complex<double> factor = a(i, pivot_column) / a(pivot_row, pivot_column);
      for (int j = 0; j < n_; ++j) {
        if (column_done_[at(j)] || !has(pivot_row, j)) continue;
        if (!has(i, j)) has(i, j) = 1, ++row_count_[at(i)], ++column_count_[at(j)];
        a(i, j) -= factor * a(pivot_row, j);
      }
    }
  }

  void collect() {
    std::vector<int> number(at(n_));
    for (int k = 0; k < n_; ++k) number[at(order_.column[at(k)])] = k;
    for (int k = 0; k < n_; ++k) {
      order_.lower.emplace_back(), order_.upper.emplace_back();
      for (int j = 0; j < n_; ++j) {
        if (!has(order_.row[at(k)], j)) continue;
        const int other = number[at(j)];
        if (other < k) order_.lower.back().push_back(other);
        if (other > k) order_.upper.back().push_back(other);
      }
      std::sort(order_.lower.back().begin(), order_.lower.back().end());
      std::sort(order_.upper.back().begin(), order_.upper.back().end());
    }
  }

  int n_;
  std::vector<std::complex<double>> a_;
  std::vector<char> entry_, row_done_, column_done_;
  double threshold_;
  std::vector<int> row_count_, column_count_;
  std::vector<double> scale_;
  Elimination order_;
};

}  // namespace

std::optional<Elimination> choose_pivots(int n, std::vector<std::complex<double>> A, std::vector<char> entry,
                                         double threshold) {
  return Markowitz(n, std::move(A), std::move(entry), threshold).run();
}

}  // namespace pendula::codegen
