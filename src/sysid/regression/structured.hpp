// Least squares on shifted copies of signals, without forming the regressor matrix.
//
// The Gram matrix of [Φ y] has displacement structure: entry (i+1, j+1) of the block of two signals is entry
// (i, j) plus one product that enters and minus one that leaves, so that only the first row and column of
// each block are sums over all samples (Kailath & Sayed, SIAM Review 37(3), 1995). Sums run over short blocks
// that are added in twice the working precision. One pass of iterative refinement with the residual y - Φθ
// (Golub & Van Loan §5.3.8) gives the digits of an orthogonal factorisation. docs/derivations.md#regression.
#pragma once

#include <optional>

#include "sysid/regression/least_squares.hpp"
#include "sysid/regression/regressor.hpp"

namespace pendula::sysid {

/// min ‖Φθ - y‖² over the usable rows. Many rows and a well-conditioned Φ: two passes over the data, cost
/// about (4d + …) rows; otherwise blocked QR, cost 2 rows d². Memory O(d²) in both.
LeastSquares solve_regression(const Regressor& regressor);

/// The factor of [Φ y] over the usable rows, in blocks; `outputs`: the columns that stand in the place of y.
TriangularFactor triangular_factor(const Regressor& regressor, const Mat* outputs = nullptr);

/// Each of the two methods by itself, for tests. solve_structured() gives nothing
/// where Φ is too badly conditioned for it (condition above 10⁴ after scaling, where squaring would cost more
/// than half the digits).
LeastSquares solve_blocked(const Regressor& regressor);
std::optional<LeastSquares> solve_structured(const Regressor& regressor);

}  // namespace pendula::sysid
