// ∂F/∂(x′, z) of a problem: where its entries are, and which unknowns they depend on.
#pragma once

#include <vector>

#include "integrate/problem/problem.hpp"
#include "integrate/solve/linear_solver.hpp"

namespace pendula::integrate {

/// Of the matrix with n + m rows, the equations, and as many columns, x′ and then z, the unknowns.
struct RhsLayout {
  std::vector<Position> positions;           ///< of the entries that are not 0 everywhere
  codegen::Kernel values;                    ///< of them, in the arguments of the problem
  std::vector<char> entry_is_nonlinear;      ///< by entry: it depends on an unknown; empty where none does
  std::vector<double> unknown_is_nonlinear;  ///< by unknown: 1 where the matrix depends on it, else 0
  /// By unknown: 1 where it may have several values while the unknowns of the blocks before its own have one.
  std::vector<double> ambiguous;
  bool linear = true, constant = true;  ///< F in the unknowns; the matrix, but for parameters
};
/// Cost: the derivatives of the equations, and one look at each entry.
RhsLayout rhs_layout(const Problem& problem);

}  // namespace pendula::integrate
