// The order of elimination: the same pivots as a search through all entries takes,
// and the fill that they make.
#include "codegen/linear/pivots.hpp"

#include <cmath>
#include <random>
#include <set>

#include <doctest/doctest.h>

namespace pendula::pivots_test {

using namespace pendula::codegen;

namespace {

using Number = std::complex<double>;

/// Markowitz' rule by looking at every entry at every step.
std::vector<std::pair<int, int>> searched(int n, std::vector<Number> A, std::vector<char> entry,
                                          double threshold) {
  const auto at = [n](int i, int j) { return static_cast<std::size_t>(i * n + j); };
  std::set<int> rows, columns;
  std::vector<double> scale;
  for (int i = 0; i < n; ++i) {
    double largest = 0;
    for (int j = 0; j < n; ++j) largest = std::max(largest, std::abs(A[at(i, j)]));
    scale.push_back(1 / largest);
    rows.insert(i);
    columns.insert(i);
  }
  std::vector<std::pair<int, int>> order;
  while (!rows.empty()) {
    std::pair<int, int> best{-1, -1};
    long least = 0;
    double size = 0;
    for (int j : columns) {
      double largest = 0;
      long in_column = 0;
      for (int i : rows)
        if (entry[at(i, j)]) {
          ++in_column;
          largest = std::max(largest, std::abs(A[at(i, j)]) * scale[i]);
        }
      for (int i : rows) {
        const double here = std::abs(A[at(i, j)]) * scale[i];
        if (!entry[at(i, j)] || here < threshold * largest) continue;
        long in_row = 0;
        for (int k : columns) in_row += entry[at(i, k)];
        const long cost = (in_row - 1) * (in_column - 1);
        if (best.first < 0 || cost < least || (cost == least && here > size)) {
          best = {i, j};
          least = cost;
          size = here;
        }
      }
    }
    const auto [p, c] = best;
    order.push_back(best);
    rows.erase(p);
    columns.erase(c);
    for (int i : rows) {
      if (!entry[at(i, c)]) continue;
      const Number factor = A[at(i, c)] / A[at(p, c)];
      for (int j : columns)
        if (entry[at(p, j)]) {
          entry[at(i, j)] = 1;
          A[at(i, j)] -= factor * A[at(p, j)];
        }
    }
  }
  return order;
}

}  // namespace

TEST_CASE("pivots: those of a search through all entries, with ties and zeros among the entries") {
  std::mt19937 random(3);
  for (int n : {1, 2, 7, 20, 45})
    for (int density : {2, 5, 12}) {
      std::vector<Number> A(static_cast<std::size_t>(n * n));
      std::vector<char> entry(A.size(), 0);
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto at = static_cast<std::size_t>(i * n + j);
          if (i != j && random() % static_cast<unsigned>(n) >= static_cast<unsigned>(density)) continue;
          entry[at] = 1;  // few different numbers: many ties
          A[at] = {static_cast<double>(random() % 4) + (i == j),
                   density == 5 ? static_cast<double>(random() % 3) : 0};
          if (i == j && n > 7 && i % 6 == 0) A[at] = 0;
        }
      if (n > 7)
        for (int i = 0; i < n; ++i) A[i * n + (i + 1) % n] = 2.5, entry[i * n + (i + 1) % n] = 1;
      const auto order = choose_pivots(n, A, entry, 0.1);
      if (!order) continue;  // singular by chance
      const auto expected = searched(n, A, entry, 0.1);
      for (std::size_t k = 0; k < expected.size(); ++k) {
        CHECK(order->row[k] == expected[k].first);
        CHECK(order->column[k] == expected[k].second);
      }
    }
}

TEST_CASE("pivots: a singular matrix has none") {
  CHECK_FALSE(choose_pivots(2, {1, 2, 2, 4}, {1, 1, 1, 1}));
  CHECK_FALSE(choose_pivots(2, {1, 0, 2, 0}, {1, 1, 1, 1}));
  CHECK_FALSE(choose_pivots(1, {NAN}, {1}));
  CHECK(choose_pivots(2, {0, 1, 1, 0}, {1, 1, 1, 1}));
}

}  // namespace pendula::pivots_test
