#include "integrate/solve/column_scale.hpp"

#include <algorithm>
#include <limits>

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

}  // namespace pendula::integrate
