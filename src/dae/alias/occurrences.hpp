// Where unknowns occur in rows, and how often.
#pragma once

#include <utility>
#include <vector>

#include "dae/alias/affine_row.hpp"

namespace pendula::dae {

/// In how many rows every unknown occurs, and where.
class Occurrences {
 public:
  Occurrences(const UnknownNumbers& numbers, const std::vector<AffineRow>& rows)
      : numbers_(numbers),
        where_(static_cast<std::size_t>(numbers.size())),
        count_(where_.size(), 0),
        inside_(where_.size(), 0) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      enter(rows[i], 1);
      note(rows[i], static_cast<int>(i));
    }
  }

  /// Counts the unknowns of a row in (1) or out (-1).
  void enter(const AffineRow& row, int sign) {
    for (const AffineRow::Term& t : row.terms) count_[t.unknown] += sign;
    for (int u : row.inside) {
      if (!row.find(u)) count_[u] += sign;
      inside_[u] += sign;
    }
  }
  /// Row i contains these unknowns.
  void note(const AffineRow& row, int i) {
    for (const AffineRow::Term& t : row.terms) where_[t.unknown].push_back(i);
    for (int u : row.inside) where_[u].push_back(i);
  }

  int count(int unknown) const { return count_[unknown]; }
  int inside(int unknown) const { return inside_[unknown]; }
  /// Rows that may contain the unknown; some no longer do, some stand there twice.
  const std::vector<int>& where(int unknown) const { return where_[unknown]; }
  std::vector<int> take(int unknown) { return std::exchange(where_[unknown], {}); }

  /// The highest derivative of the unknown that occurs.
  int highest(int base) const {
    int k = numbers_.stride() - 1;
    while (k > 0 && count_[base + k] == 0) --k;
    return k;
  }
  bool is_top(int unknown) const {
    return numbers_.order(unknown) > 0 && numbers_.order(unknown) == highest(numbers_.base(unknown));
  }

 private:
  const UnknownNumbers& numbers_;
  std::vector<std::vector<int>> where_;
  std::vector<int> count_, inside_;  ///< rows with each unknown; rows with it in their rest
};

}  // namespace pendula::dae
