#include "sysid/data/excitation.hpp"

#include <algorithm>
#include <cmath>

#include "base/epsilon.hpp"
#include "base/triangular_factor.hpp"

namespace pendula::sysid {
int excitation_order(const IdData& d, Index input, int limit) {
  const Vec u = d.u.col(input);
  const auto n = std::min<Index>(limit, (d.samples() + 1) / 2);
  if (n < 1) return 0;
  TriangularFactor factor(n);
  Index rows = 0;
  Mat block(TriangularFactor::block_rows, n);
  for (Index k = 0; k < d.experiments(); ++k)
    for (Index t = d.starts[k] + n - 1; t < d.end(k); ++t) {
      const auto window = u.segment(t - n + 1, n);
      if (!window.allFinite()) continue;
      block.row(rows++) = window.reverse().transpose();
      if (rows == block.rows()) {
        factor.add(block);
        rows = 0;
      }
    }
  if (rows > 0) factor.add(block.topRows(rows));
  // N ε: bound of the rounding of a QR factorisation relative to a column (Higham 2002, §19.3)
  const double tolerance = static_cast<double>(std::max<Index>(d.samples(), n)) * eps;
  Index order = 0;
  while (order < n && std::abs(factor.R()(order, order)) > tolerance * factor.R().col(order).norm()) ++order;
  return static_cast<int>(order);
}

}  // namespace pendula::sysid
