// ∂F/∂(x′, z) of a problem: where its entries are, and which unknowns they depend on.
#pragma once

#include <vector>

#include "integrate/problem/problem.hpp"
#include "integrate/solve/linear_solver.hpp"

namespace pendula::integrate {

struct RhsLayout {
  std::vector<Position> positions;
  codegen::Kernel values;
  std::vector<char> bent;      ///< by entry: it depends on an unknown
  std::vector<double> curved;  ///< by unknown: 1 where the matrix depends on it, else 0
  /// By unknown: 1 where it may have several values while the unknowns of the blocks before its own have one.
  std::vector<double> ambiguous;
  bool linear = true, constant = true;
};
RhsLayout rhs_layout(const Problem& problem);

}  // namespace pendula::integrate
