#include "codegen/program/symmetric.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>

namespace pendula::codegen {
namespace {

std::vector<int> minimum_degree(int n, const std::vector<SymmetricEntry>& entries) {
  std::vector<Eigen::Triplet<double>> places;
  for (const SymmetricEntry& e : entries) {
    places.emplace_back(e.row, e.column, 1.0);
    places.emplace_back(e.column, e.row, 1.0);
  }
  Eigen::SparseMatrix<double> pattern(n, n);
  pattern.setFromTriplets(places.begin(), places.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  return {permutation.indices().begin(), permutation.indices().end()};
}

/// The number of multiplications of the elimination in this order.
std::size_t work_of(int n, const std::vector<SymmetricEntry>& entries, const std::vector<int>& order);

/// Eliminates in every round unknowns of low degree that are not adjacent. Their eliminations are independent
/// and become loops of the tape. On a chain this is cyclic reduction: log₂ n rounds with two to three times
/// the operations of the sequential order.
std::vector<int> rounds(int n, const std::vector<SymmetricEntry>& entries) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  std::vector<std::set<int>> neighbours(at(n));
  for (const SymmetricEntry& e : entries)
    if (e.row != e.column) {
      neighbours[at(e.row)].insert(e.column);
      neighbours[at(e.column)].insert(e.row);
    }
  std::vector<int> left(at(n)), order;
  std::iota(left.begin(), left.end(), 0);
  while (!left.empty()) {
    std::size_t least = left.size();
    for (int i : left) least = std::min(least, neighbours[at(i)].size());
    std::vector<char> blocked(at(n), 0);
    std::vector<int> later;
    for (int i : left) {
      if (blocked[at(i)] || neighbours[at(i)].size() > least + 1) {
        later.push_back(i);
        continue;
      }
      order.push_back(i);
      const std::set<int> around = neighbours[at(i)];
      for (int j : around) {
        blocked[at(j)] = 1;
        neighbours[at(j)].erase(i);
        for (int k : around)
          if (k != j) neighbours[at(j)].insert(k);
      }
    }
    left = std::move(later);
  }
  return order;
}

std::size_t work_of(int n, const std::vector<SymmetricEntry>& entries, const std::vector<int>& order) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  std::vector<int> step(at(n));
  for (int k = 0; k < n; ++k) step[at(order[at(k)])] = k;
  std::vector<std::set<int>> below(at(n));
  for (const SymmetricEntry& e : entries)
    if (e.row != e.column)
      below[at(std::min(step[at(e.row)], step[at(e.column)]))].insert(
          std::max(step[at(e.row)], step[at(e.column)]));
  std::size_t work = 0;
  for (int k = 0; k < n; ++k) {
    const std::set<int>& column = below[at(k)];
    work += column.size() * (column.size() + 7) / 2 + 2;
    for (auto i = column.begin(); i != column.end(); ++i) below[at(*i)].insert(std::next(i), column.end());
  }
  return work;
}

constexpr int large = 100;  // below, code without loops is fast

std::vector<int> elimination_order(int n, const std::vector<SymmetricEntry>& entries) {
  std::vector<int> order = minimum_degree(n, entries);
  if (n < large) return order;
  std::vector<int> parallel = rounds(n, entries);
  return work_of(n, entries, parallel) <= 3 * work_of(n, entries, order) ? parallel : order;
}

/// The unknowns of M first, then the others, which are adjacent if they couple to a common block of M.
std::optional<std::vector<int>> saddle_order(int n, int leading, const std::vector<SymmetricEntry>& entries) {
  std::vector<int> block(static_cast<std::size_t>(leading));
  std::iota(block.begin(), block.end(), 0);
  const auto root = [&block](int i) {
    while (block[i] != i) i = block[i] = block[block[i]];
    return i;
  };
  std::vector<SymmetricEntry> mass;
  std::set<int> diagonal;
  for (const SymmetricEntry& e : entries) {
    if (e.row >= leading || e.column >= leading) continue;
    mass.push_back(e);
    block[root(e.row)] = root(e.column);
    if (e.row == e.column) diagonal.insert(e.row);
  }
  std::map<int, std::set<int>> around;  // multipliers by block
  std::set<int> touched;
  std::vector<SymmetricEntry> schur;
  for (const SymmetricEntry& e : entries) {
    if (e.row < leading) continue;
    if (e.column < leading)
      around[root(e.column)].insert(e.row - leading);
    else
      schur.push_back({e.row - leading, e.column - leading, 0});
    if (e.column < leading || e.column == e.row) touched.insert(e.row);
  }
  if (static_cast<int>(diagonal.size()) < leading || static_cast<int>(touched.size()) < n - leading)
    return std::nullopt;
  for (const auto& [which, members] : around)
    for (int i : members)
      for (int j : members) schur.push_back({i, j, 0});
  std::vector<int> order = elimination_order(leading, mass);
  if (n > leading)
    for (int k : elimination_order(n - leading, schur)) order.push_back(leading + k);
  return order;
}

using Neighbours = std::vector<std::vector<int>>;

int width_of(std::span<const std::pair<int, int>> places, const std::vector<int>& step) {
  int width = 0;
  for (const auto& [i, j] : places) width = std::max(width, std::abs(step[i] - step[j]));
  return width;
}

/// The unknowns reached from `start` in breadth-first order, those with few neighbours first.
std::vector<int> by_distance(const Neighbours& neighbours, int start, std::vector<char>& seen) {
  std::vector<int> order{start};
  seen[start] = 1;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t first = order.size();
    for (int j : neighbours[order[k]])
      if (!std::exchange(seen[j], 1)) order.push_back(j);
    std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(first), order.end(),
                     [&](int p, int q) { return neighbours[p].size() < neighbours[q].size(); });
  }
  return order;
}

/// Cuthill–McKee from a peripheral unknown of each part: the last one reached from the last one reached.
std::vector<int> cuthill_mckee(int n, std::span<const std::pair<int, int>> places) {
  Neighbours neighbours(static_cast<std::size_t>(n));
  for (const auto& [i, j] : places)
    if (i != j) {
      neighbours[i].push_back(j);
      neighbours[j].push_back(i);
    }
  for (std::vector<int>& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  std::vector<int> step(static_cast<std::size_t>(n));
  std::vector<char> seen(static_cast<std::size_t>(n), 0);
  int next = 0;
  for (int i = 0; i < n; ++i) {
    if (seen[i]) continue;
    int start = i;
    for (int sweep = 0; sweep < 2; ++sweep) {
      const std::vector<int> reached = by_distance(neighbours, start, seen);
      for (int j : reached) seen[j] = 0;
      start = reached.back();
    }
    for (int j : by_distance(neighbours, start, seen)) step[j] = next++;
  }
  return step;
}

}  // namespace

std::optional<BandOrder> band_order(int n, std::span<const std::pair<int, int>> places) {
  constexpr int narrow = 6;
  if (n < large) return std::nullopt;
  std::vector<int> step(static_cast<std::size_t>(n));
  std::iota(step.begin(), step.end(), 0);
  int width = width_of(places, step);
  if (width > narrow) {
    step = cuthill_mckee(n, places);
    width = width_of(places, step);
  }
  if (width > narrow) return std::nullopt;
  return BandOrder{std::move(step), std::max(width, 1)};
}

/// Eliminates the last `n - leading` unknowns after the others.
static SymmetricFactor factor_in_order(int n, int leading, const std::vector<SymmetricEntry>& entries,
                                       std::vector<int> order, const Emit& emit) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  SymmetricFactor f;
  f.order = std::move(order);
  f.leading = leading;
  std::vector<int> step(at(n));
  for (int k = 0; k < n; ++k) step[at(f.order[at(k)])] = k;
  std::vector<std::map<int, Slot>> rows(at(n));  // upper triangle, by steps
  for (const SymmetricEntry& e : entries) {
    const int i = step[at(e.row)], j = step[at(e.column)];
    rows[at(std::min(i, j))].emplace(std::max(i, j), e.value);
  }
  const auto note_diagonal = [&](int from, int to) {
    for (int k = from; k < to; ++k) f.diagonal.push_back(rows[at(k)].at(k));
  };
  note_diagonal(0, leading);
  for (int k = leading; k < n; ++k)
    if (const auto own = rows[at(k)].find(k); own != rows[at(k)].end()) f.corner.push_back(own->second);
  const Slot one = emit(Op::constant, 0, 0);
  for (int k = 0; k < n; ++k) {
    if (k == leading) note_diagonal(leading, n);
    const std::map<int, Slot>& pivot_row = rows[at(k)];
    f.pivot.push_back(pivot_row.at(k));
    f.reciprocal.push_back(emit(Op::div, one, pivot_row.at(k)));
    f.below.emplace_back();
    for (auto i = pivot_row.upper_bound(k); i != pivot_row.end(); ++i) {
      const Slot l = emit(Op::mul, i->second, f.reciprocal.back());
      f.below.back().push_back({i->first, l});
      std::map<int, Slot>& row = rows[at(i->first)];
      for (auto j = i; j != pivot_row.end(); ++j) {
        const Slot product = emit(Op::mul, l, j->second);
        const auto old = row.find(j->first);
        if (old == row.end())
          row[j->first] = emit(Op::neg, product, 0);  // fill
        else
          old->second = emit(Op::sub, old->second, product);
      }
    }
  }
  return f;
}

SymmetricFactor factor_symmetric(int n, const std::vector<SymmetricEntry>& entries, const Emit& emit) {
  return factor_in_order(n, n, entries, elimination_order(n, entries), emit);
}

std::optional<SymmetricFactor> factor_saddle(int n, int leading, const std::vector<SymmetricEntry>& entries,
                                             const Emit& emit) {
  std::optional<std::vector<int>> order = saddle_order(n, leading, entries);
  constexpr int small = 32;  // below this size written-out symmetric elimination is faster in any case
  if (!order || (n > small && 12.0 * static_cast<double>(work_of(n, entries, *order)) > 1.0 * n * n * n))
    return std::nullopt;
  return factor_in_order(n, leading, entries, std::move(*order), emit);
}

Slot is_sound(const SymmetricFactor& f, Slot zero, Slot smallest, const Emit& emit) {
  std::optional<Slot> least;
  for (std::size_t k = 0; k < f.pivot.size(); ++k) {
    const bool changed = f.pivot[k] != f.diagonal[k], of_mass = static_cast<int>(k) < f.leading;
    const Slot pivot = f.pivot[k], bound = changed ? emit(Op::mul, smallest, f.diagonal[k]) : zero;
    const Slot margin = of_mass && !changed ? pivot
                        : of_mass           ? emit(Op::sub, pivot, bound)
                                            : emit(Op::sub, bound, pivot);
    // min with this order of operands keeps an earlier NaN margin
    // order of the operands keeps.
    least = least ? emit(Op::min, margin, *least) : margin;
  }
  Slot sound = emit(Op::lt, zero, *least);
  for (Slot own : f.corner) sound = emit(Op::mul, sound, emit(Op::le, own, zero));
  return sound;
}

std::vector<Slot> solve_symmetric(const SymmetricFactor& f, const std::vector<Slot>& b, const Emit& emit) {
  const std::size_t n = b.size();
  std::vector<Slot> y(n), x(n);
  for (std::size_t k = 0; k < n; ++k) y[k] = b[f.order[k]];
  for (std::size_t k = 0; k < n; ++k)
    for (const auto& [row, l] : f.below[k]) {
      Slot& to = y[row];
      to = emit(Op::sub, to, emit(Op::mul, l, y[k]));
    }
  for (std::size_t k = n; k-- > 0;) {
    y[k] = emit(Op::mul, y[k], f.reciprocal[k]);
    for (const auto& [row, l] : f.below[k]) y[k] = emit(Op::sub, y[k], emit(Op::mul, l, y[row]));
    x[f.order[k]] = y[k];
  }
  return x;
}

std::vector<Slot> solve_saddle(const SymmetricFactor& f, const std::vector<SymmetricEntry>& entries,
                               const std::vector<Slot>& b, const Emit& emit) {
  const auto leading = static_cast<std::size_t>(f.leading);
  std::vector<Slot> x = solve_symmetric(f, b, emit), rest = b;
  for (const SymmetricEntry& e : entries)
    if (e.row >= f.leading) rest[e.row] = emit(Op::sub, rest[e.row], emit(Op::mul, e.value, x[e.column]));
  std::vector<Slot> y(b.size());  // of the correction: the right side above is zero
  for (std::size_t k = leading; k < y.size(); ++k) y[k] = rest[f.order[k]];
  for (std::size_t k = leading; k < y.size(); ++k)
    for (const auto& [row, l] : f.below[k]) y[row] = emit(Op::sub, y[row], emit(Op::mul, l, y[k]));
  std::vector<char> moves(y.size(), 0);
  for (std::size_t k = y.size(); k-- > 0;) {
    if (k >= leading) {
      y[k] = emit(Op::mul, y[k], f.reciprocal[k]);
      moves[k] = 1;
    }
    for (const auto& [row, l] : f.below[k]) {
      if (!moves[row]) continue;
      const Slot effect = emit(Op::mul, l, y[row]);
      y[k] = moves[k] ? emit(Op::sub, y[k], effect) : emit(Op::neg, effect, 0);
      moves[k] = 1;
    }
    if (moves[k]) x[f.order[k]] = emit(Op::add, x[f.order[k]], y[k]);
  }
  return x;
}

}  // namespace pendula::codegen
