#include <algorithm>
#include <mutex>
#include <numeric>
#include <optional>

#include "codegen/program/program_cache.hpp"
#include "integrate/solve/band_lu.hpp"

namespace pendula::integrate {
namespace {

std::size_t slot(int i) { return static_cast<std::size_t>(i); }

/// Lists of numbers, stored consecutively.
struct Lists {
  std::vector<int> first, item;
  Lists(int n, const std::vector<Position>& pairs) : first(slot(n) + 1, 0), item(pairs.size()) {
    for (const Position& p : pairs) ++first[slot(p.row) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<int> next(first.begin(), first.end() - 1);
    for (const Position& p : pairs) item[slot(next[slot(p.row)]++)] = p.column;
  }
  const int* begin(int i) const { return item.data() + first[slot(i)]; }
  const int* end(int i) const { return item.data() + first[slot(i) + 1]; }
  int size(int i) const { return first[slot(i) + 1] - first[slot(i)]; }
};

/// A matching of rows to columns that prefers the diagonal.
class Matching {
 public:
  Matching(int n, const std::vector<Position>& positions)
      : columns_of_(n, positions), row_of(slot(n), -1), column_of_(slot(n), -1), seen_(slot(n), -1) {
    for (const Position& p : positions)
      if (p.row == p.column) row_of[slot(p.row)] = column_of_[slot(p.row)] = p.row;
    for (int i = 0; i < n; ++i)
      for (const int* j = columns_of_.begin(i); column_of_[slot(i)] < 0 && j != columns_of_.end(i); ++j)
        if (row_of[slot(*j)] < 0) {
          row_of[slot(*j)] = i;
          column_of_[slot(i)] = *j;
        }
    long left = 100 * static_cast<long>(positions.size()) + 1000;
    for (int i = 0; i < n && complete; ++i)
      if (column_of_[slot(i)] < 0) complete = augment(i, left);
  }

  bool complete = true;

 private:
  /// Searches depth first for an augmenting path from an unmatched row to an unmatched column.
  bool augment(int start, long& left) {
    struct Place {
      int row;
      const int* next;
    };
    std::vector<Place> path{{start, columns_of_.begin(start)}};
    while (!path.empty()) {
      Place& here = path.back();
      if (here.next == columns_of_.end(here.row)) {
        path.pop_back();
        if (!path.empty()) ++path.back().next;
        continue;
      }
      const int j = *here.next;
      if (--left < 0) return false;
      if (seen_[slot(j)] == start) {
        ++here.next;
        continue;
      }
      seen_[slot(j)] = start;
      if (row_of[slot(j)] >= 0) {
        path.push_back({row_of[slot(j)], columns_of_.begin(row_of[slot(j)])});
        continue;
      }
      for (const Place& p : path) {
        row_of[slot(*p.next)] = p.row;
        column_of_[slot(p.row)] = *p.next;
      }
      return true;
    }
    return false;
  }
  Lists columns_of_;

 public:
  std::vector<int> row_of;

 private:
  std::vector<int> column_of_, seen_;
};

/// Breadth-first search from a vertex, neighbours by ascending degree; appends to `order`. Returns a vertex
/// of minimal degree in the last level.
int walk(const Lists& graph, int from, std::vector<int>& order, std::vector<char>& seen) {
  std::size_t level = order.size(), done = level;
  order.push_back(from);
  seen[slot(from)] = 1;
  while (done < order.size()) {
    level = done;
    for (const std::size_t end = order.size(); done < end; ++done) {
      const std::size_t first = order.size();
      for (const int* j = graph.begin(order[done]); j != graph.end(order[done]); ++j)
        if (!seen[slot(*j)]) {
          seen[slot(*j)] = 1;
          order.push_back(*j);
        }
      std::sort(order.begin() + static_cast<std::ptrdiff_t>(first), order.end(), [&](int a, int b) {
        return graph.size(a) != graph.size(b) ? graph.size(a) < graph.size(b) : a < b;
      });
    }
  }
  return *std::min_element(order.begin() + static_cast<std::ptrdiff_t>(level), order.end(),
                           [&](int a, int b) { return graph.size(a) < graph.size(b); });
}

std::vector<int> cuthill_mckee(int n, const Lists& graph) {
  std::vector<int> order;
  std::vector<char> seen(slot(n), 0);
  order.reserve(slot(n));
  for (int i = 0; i < n; ++i) {
    if (seen[slot(i)]) continue;
    const auto first = static_cast<std::ptrdiff_t>(order.size());
    int from = i;
    for (int times = 0; times < 3; ++times) {
      if (times > 0) {
        for (auto v = order.begin() + first; v != order.end(); ++v) seen[slot(*v)] = 0;
        order.resize(static_cast<std::size_t>(first));
      }
      from = walk(graph, from, order, seen);
    }
  }
  return order;
}

std::optional<BandOrder> found(int n, const std::vector<Position>& positions) {
  const Matching matching(n, positions);
  if (!matching.complete) return {};
  std::vector<int> vertex(slot(n));  // the column matched to each row
  for (int j = 0; j < n; ++j) vertex[slot(matching.row_of[slot(j)])] = j;
  std::vector<Position> edges;
  for (const Position& p : positions) {
    const int v = vertex[slot(p.row)];
    if (v != p.column) edges.push_back({v, p.column}), edges.push_back({p.column, v});
  }
  const auto before = [](const Position& a, const Position& b) {
    return a.row != b.row ? a.row < b.row : a.column < b.column;
  };
  std::sort(edges.begin(), edges.end(), before);
  edges.erase(std::unique(edges.begin(), edges.end(),
                          [](const Position& a, const Position& b) {
                            return a.row == b.row && a.column == b.column;
                          }),
              edges.end());
  BandOrder result;
  result.column = cuthill_mckee(n, Lists(n, edges));
  std::vector<int> place(slot(n));
  for (int k = 0; k < n; ++k) {
    place[slot(result.column[slot(k)])] = k;
    result.row.push_back(matching.row_of[slot(result.column[slot(k)])]);
  }
  for (const Position& p : positions) {
    const int distance = place[slot(vertex[slot(p.row)])] - place[slot(p.column)];
    result.below = std::max(result.below, distance);
    result.above = std::max(result.above, -distance);
  }
  if (result.below > BandOrder::widest || result.above > BandOrder::widest) return {};
  return result;
}

struct Answer {
  std::shared_ptr<const BandOrder> order;
};

}  // namespace

std::shared_ptr<const BandOrder> BandOrder::find(int n, const std::vector<Position>& positions) {
  if (positions.size() > slot(n) * (2 * widest + 1)) return nullptr;
  codegen::Key key{static_cast<std::uint32_t>(n)};
  for (const Position& p : positions) {
    key.push_back(static_cast<std::uint32_t>(p.row));
    key.push_back(static_cast<std::uint32_t>(p.column));
  }
  static std::mutex mutex;
  static codegen::ProgramCache<Answer> answers;
  const std::lock_guard lock(mutex);
  if (const auto known = answers.find(key)) return known->order;
  auto order = found(n, positions);
  const auto answer = std::make_shared<Answer>();
  if (order) answer->order = std::make_shared<const BandOrder>(std::move(*order));
  answers.add(key, answer, slot(n));
  return answer->order;
}

}  // namespace pendula::integrate
