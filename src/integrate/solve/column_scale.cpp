#include "integrate/solve/column_scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dae/rank/rank_with_gap.hpp"

namespace pendula::integrate {

std::vector<double> column_scale(int n, std::span<const Position> positions, std::span<const double> sizes) {
  std::vector<double> row(static_cast<std::size_t>(n), 0), column = row;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    if (!(sizes[k] <= std::numeric_limits<double>::max())) return {};
    row[positions[k].row] = std::max(row[positions[k].row], sizes[k]);
  }
  for (std::size_t k = 0; k < positions.size(); ++k)
    if (sizes[k] > 0)
      column[positions[k].column] = std::max(column[positions[k].column], sizes[k] / row[positions[k].row]);
  for (double& c : column) {
    if (c == 0) return {};
    c = 1 / c;
  }
  return column;
}

/// Can a product of n entries be lost beside products of others? Relative to their rows, with the columns
/// scaled; a matrix in which none can is singular in any units.
static bool has_far_products(int n, std::span<const Position> positions, std::span<const double> sizes) {
  constexpr double lost = 1e-12;  // of a row: LinearSolver takes such pivots for rounding
  const std::vector<double> column = column_scale(n, positions, sizes);
  if (column.empty()) return false;
  std::vector<double> row(static_cast<std::size_t>(n), 0);
  const auto scaled = [&](std::size_t k) { return sizes[k] * column[positions[k].column]; };
  for (std::size_t k = 0; k < sizes.size(); ++k)
    row[positions[k].row] = std::max(row[positions[k].row], scaled(k));
  double least = 1;
  for (std::size_t k = 0; k < sizes.size(); ++k)
    if (sizes[k] > 0) least = std::min(least, scaled(k) / row[positions[k].row]);
  return std::pow(least, n) < lost;
}

std::vector<double> balanced_column_scale(int n, std::span<const Position> positions,
                                          std::span<const double> sizes) {
  if (!has_far_products(n, positions, sizes)) return {};
  std::vector<dae::EntrySize> entries;
  std::vector<char> occurs(static_cast<std::size_t>(n), 0);
  for (std::size_t k = 0; k < positions.size(); ++k) {
    if (!std::isfinite(sizes[k])) return {};
    if (sizes[k] > 0) occurs[positions[k].column] = 1;
    entries.push_back({positions[k].row, positions[k].column, sizes[k]});
  }
  if (std::find(occurs.begin(), occurs.end(), 0) != occurs.end()) return {};
  const dae::Balance balance = dae::balance(n, n, entries);
  // factors whose products with entries overflow are no units
  constexpr double largest = 1e150;
  if (!(balance.columns.maxCoeff() < largest && balance.columns.minCoeff() > 1 / largest)) return {};
  return {balance.columns.begin(), balance.columns.end()};
}

}  // namespace pendula::integrate
