#include "dae/structure/blocks.hpp"

#include <algorithm>

namespace pendula::dae {
namespace {

constexpr int none = -1;

/// Maximum matching in phases of disjoint augmenting paths, depth first with lookahead (Pothen & Fan 1990,
/// §3); iterative. A dead end is visited once per phase, and there are few phases.
class Matching {
 public:
  Matching(const Pattern& pattern, int columns)
      : pattern_(pattern),
        row_of(columns, none),
        column_of(pattern.size(), none),
        visited_(columns, none),
        look_(pattern.size(), 0),
        next_(pattern.size(), 0) {
    while (phase()) ++number_;
  }

 private:
  const Pattern& pattern_;

 public:
  std::vector<int> row_of, column_of;

 private:
  /// False when no path was found: the matching is maximum.
  bool phase() {
    bool any = false;
    std::fill(next_.begin(), next_.end(), 0);
    for (int i = 0; i < static_cast<int>(pattern_.size()); ++i)
      if (column_of[i] == none && augment(i)) any = true;
    return any;
  }

  int free_column(int i) {  // visits every column once per row over all phases
    for (auto& k = look_[i]; k < pattern_[i].size(); ++k)
      if (row_of[pattern_[i][k]] == none) return pattern_[i][k];
    return none;
  }

  bool augment(int start) {
    std::vector<int> path{start};
    while (!path.empty()) {
      const int i = path.back();
      if (int j = free_column(i); j != none) {
        for (auto it = path.rbegin(); it != path.rend(); ++it) {
          std::swap(j, column_of[*it]);
          row_of[column_of[*it]] = *it;
        }
        return true;
      }
      bool deeper = false;
      while (next_[i] < pattern_[i].size() && !deeper) {
        const int j = pattern_[i][next_[i]++];
        if (visited_[j] == number_) continue;
        visited_[j] = number_;
        path.push_back(row_of[j]);
        deeper = true;
      }
      if (!deeper) path.pop_back();
    }
    return false;
  }

  int number_ = 0;  // of the phase
  std::vector<int> visited_;
  std::vector<std::size_t> look_, next_;
};

Pattern transposed(const Pattern& pattern, int columns) {
  Pattern t(columns);
  for (int i = 0; i < static_cast<int>(pattern.size()); ++i)
    for (int j : pattern[i]) t[j].push_back(i);
  return t;
}

/// Alternating breadth-first search: from unmatched vertices of one side over arbitrary edges, back
/// over matched edges.
Part reach(const Pattern& edges, const std::vector<int>& own_partner, const std::vector<int>& other_partner) {
  std::vector<char> seen(own_partner.size(), 0), seen_other(other_partner.size(), 0);
  Part part;
  std::vector<int>& queue = part.rows;
  for (int v = 0; v < static_cast<int>(own_partner.size()); ++v)
    if (own_partner[v] == none) {
      queue.push_back(v);
      seen[v] = 1;
    }
  for (std::size_t head = 0; head < queue.size(); ++head)
    for (int w : edges[queue[head]]) {
      if (seen_other[w]) continue;
      seen_other[w] = 1;
      part.columns.push_back(w);
      if (const int v = other_partner[w]; v != none && !seen[v]) {
        seen[v] = 1;
        queue.push_back(v);
      }
    }
  std::sort(part.rows.begin(), part.rows.end());
  std::sort(part.columns.begin(), part.columns.end());
  return part;
}

/// Strongly connected components of the rows, an edge i → row_of[j] for every entry
/// (i, j): Tarjan (1972), iterative.
class Components {
 public:
  Components(const Pattern& pattern, const std::vector<int>& row_of, const std::vector<char>& inside)
      : pattern_(pattern),
        row_of_(row_of),
        inside_(inside),
        number_(pattern.size(), none),
        low_(pattern.size(), 0),
        next_(pattern.size(), 0),
        on_stack_(pattern.size(), 0) {
    for (int i = 0; i < static_cast<int>(pattern.size()); ++i)
      if (inside[i] && number_[i] == none) visit(i);
  }
  std::vector<std::vector<int>> components;  ///< each after those it depends on

 private:
  void open(int i) {
    number_[i] = low_[i] = count_++;
    stack_.push_back(i);
    on_stack_[i] = 1;
    path_.push_back(i);
  }

  void visit(int start) {
    open(start);
    while (!path_.empty()) {
      const int i = path_.back();
      if (next_[i] < pattern_[i].size()) {
        const int k = row_of_[pattern_[i][next_[i]++]];
        if (k == none || !inside_[k]) continue;
        if (number_[k] == none)
          open(k);
        else if (on_stack_[k])
          low_[i] = std::min(low_[i], number_[k]);
        continue;
      }
      path_.pop_back();
      if (!path_.empty()) low_[path_.back()] = std::min(low_[path_.back()], low_[i]);
      if (low_[i] == number_[i]) close(i);
    }
  }

  void close(int i) {
    std::vector<int> component;
    int k;
    do {
      k = stack_.back();
      stack_.pop_back();
      on_stack_[k] = 0;
      component.push_back(k);
    } while (k != i);
    std::sort(component.begin(), component.end());
    components.push_back(std::move(component));
  }

  const Pattern& pattern_;
  const std::vector<int>& row_of_;
  const std::vector<char>& inside_;
  std::vector<int> number_, low_;
  std::vector<std::size_t> next_;
  std::vector<char> on_stack_;
  std::vector<int> stack_, path_;
  int count_ = 0;
};

}  // namespace

Blocks dulmage_mendelsohn(const Pattern& pattern, int columns) {
  const Matching matching(pattern, columns);
  Blocks blocks;
  blocks.row_of = matching.row_of;
  blocks.over = reach(pattern, matching.column_of, matching.row_of);
  Part under = reach(transposed(pattern, columns), matching.row_of, matching.column_of);
  blocks.under = {std::move(under.columns), std::move(under.rows)};
  std::vector<char> inside(pattern.size(), 1);
  for (int i : blocks.over.rows) inside[i] = 0;
  for (int i : blocks.under.rows) inside[i] = 0;
  for (auto& rows : Components(pattern, matching.row_of, inside).components) {
    Part part;
    for (int i : rows) part.columns.push_back(matching.column_of[i]);
    std::sort(part.columns.begin(), part.columns.end());
    part.rows = std::move(rows);
    blocks.square.push_back(std::move(part));
  }
  return blocks;
}

}  // namespace pendula::dae
