#include "dae/rank/modular.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "base/interrupt.hpp"
#include "expr/generic/generic.hpp"

namespace pendula::dae {
namespace {

__extension__ using Wide = unsigned __int128;

constexpr Residue prime = (Residue{1} << 61) - 1;

Residue reduce(Residue x) {
  x = (x & prime) + (x >> 61);
  return x >= prime ? x - prime : x;
}
Residue plus(Residue a, Residue b) { return reduce(a + b); }
Residue minus(Residue a) { return a ? prime - a : 0; }
Residue times(Residue a, Residue b) {
  const Wide product = static_cast<Wide>(a) * b;
  return reduce(static_cast<Residue>(product & prime) + static_cast<Residue>(product >> 61));
}
Residue power(Residue base, std::uint64_t n) {
  Residue result = 1;
  for (; n; n >>= 1, base = times(base, base))
    if (n & 1) result = times(result, base);
  return result;
}
Residue inverse(Residue a) { return power(a, prime - 2); }  // Fermat

/// Sparse elimination over the field; rows with fewest entries first.
class Elimination {
 public:
  Elimination(std::span<const Entry> entries, const std::vector<Residue>& values, int rows, int columns)
      : rows_(rows), users_(columns), done_(rows, 0) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      if (values[k] == 0) continue;
      rows_[entries[k].row][entries[k].column] = values[k];
      users_[entries[k].column].push_back(entries[k].row);
    }
    for (int i = 0; i < rows; ++i) queue_.insert({rows_[i].size(), i});
  }

  ModularRank run(int columns) {
    ModularRank result;
    std::vector<char> pivot_column(columns, 0);
    while (!queue_.empty()) {
      poll_interrupt();
      const int i = queue_.begin()->second;
      queue_.erase(queue_.begin());
      done_[i] = 1;
      if (rows_[i].empty()) {
        result.dependent_rows.push_back(i);
        continue;
      }
      const int j = fewest_users(rows_[i]);
      pivot_column[j] = 1;
      ++result.rank;
      for (int k : std::vector<int>(users_[j]))
        if (!done_[k] && rows_[k].count(j)) eliminate(k, i, j);
      rows_[i].clear();
    }
    for (int j = 0; j < columns; ++j)
      if (!pivot_column[j]) result.dependent_columns.push_back(j);
    std::sort(result.dependent_rows.begin(), result.dependent_rows.end());
    return result;
  }

 private:
  using Row = std::map<int, Residue>;

  int fewest_users(const Row& row) const {
    return std::min_element(
               row.begin(), row.end(),
               [&](const auto& a, const auto& b) { return users_[a.first].size() < users_[b.first].size(); })
        ->first;
  }

  void eliminate(int k, int i, int j) {
    queue_.erase({rows_[k].size(), k});
    const Residue factor = minus(times(rows_[k].at(j), inverse(rows_[i].at(j))));
    for (const auto& [column, value] : rows_[i]) {
      const auto [entry, made] = rows_[k].try_emplace(column, 0);
      entry->second = plus(entry->second, times(factor, value));
      if (entry->second == 0)
        rows_[k].erase(entry);
      else if (made)
        users_[column].push_back(k);
    }
    queue_.insert({rows_[k].size(), k});
  }

  std::vector<Row> rows_;
  std::vector<std::vector<int>> users_;
  std::vector<char> done_;
  std::set<std::pair<std::size_t, int>> queue_;
};

}  // namespace

std::vector<Residue> evaluate_modular(std::span<const Expr> outputs, int attempt) {
  const auto pieces = attempt % 2 == 0 ? generic::Pieces::first : generic::Pieces::second;
  std::vector<Residue> values;
  for (const generic::Residue r :
       generic::residues_at(outputs, static_cast<std::uint64_t>(attempt + 1), pieces))
    values.push_back(r.value);
  return values;
}

std::map<int, Residue> first_dependency(std::vector<std::map<int, Residue>> rows) {
  struct Reduced {
    std::map<int, Residue> row, combination;
  };
  std::map<int, Reduced> pivots;  // by the last column of the row
  const auto add = [](std::map<int, Residue>& to, const std::map<int, Residue>& from, Residue factor) {
    for (const auto& [j, value] : from)
      if (Residue& here = to[j]; (here = plus(here, times(factor, value))) == 0) to.erase(j);
  };
  for (std::size_t i = 0; i < rows.size(); ++i) {
    poll_interrupt();
    Reduced r{std::move(rows[i]), {{static_cast<int>(i), 1}}};
    for (auto it = r.row.rbegin(); it != r.row.rend();) {
      const int column = it->first;
      const auto pivot = pivots.find(column);
      if (pivot == pivots.end()) {
        ++it;
        continue;
      }
      const Residue factor = minus(times(it->second, inverse(pivot->second.row.at(column))));
      add(r.row, pivot->second.row, factor);
      add(r.combination, pivot->second.combination, factor);
      it = std::make_reverse_iterator(r.row.lower_bound(column));
    }
    if (r.row.empty()) return r.combination;
    pivots[r.row.rbegin()->first] = std::move(r);
  }
  return {};
}

ModularRank modular_rank(std::span<const Entry> entries, int rows, int columns) {
  std::vector<Expr> outputs;
  for (const Entry& e : entries) outputs.push_back(e.value);
  std::optional<ModularRank> best;
  for (int attempt = 0, tried = 0; attempt < 20 && tried < 3; ++attempt) {
    const auto values = evaluate_modular(outputs, attempt);
    if (values.size() != outputs.size()) continue;
    ++tried;
    ModularRank next = Elimination(entries, values, rows, columns).run(columns);
    if (!best || next.rank > best->rank) best = std::move(next);
    if (best->rank == std::min(rows, columns)) break;
  }
  return best.value_or(ModularRank{});
}

}  // namespace pendula::dae
