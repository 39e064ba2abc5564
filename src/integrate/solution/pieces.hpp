// The continuous extension of a solution as polynomials, piece by piece: what a file keeps of it.
#pragma once

#include "integrate/solution/solution.hpp"

namespace pendula::integrate {

/// The polynomial through values at the Chebyshev points of from < t < to.
struct Piece {
  double from = 0, to = 0;
  Mat values;  ///< (2n + m) × points: x, x′ and z of the user's variables, one column per point in ascending time
};

/// A solution between its saved times, each unknown within 1e-10 of its largest size, or
/// as near as its own noise allows.
///
/// returns  no pieces where the solution knows its saved points only
std::vector<Piece> pieces_of(const Solution& solution);

/// The continuous extension that consists of these pieces; n, m: how many of the unknowns are x and z.
/// Throws Error unless the pieces follow one another and have the sizes that belong to n and m.
std::shared_ptr<Continuation> continuation_of(std::vector<Piece> pieces, int n, int m);

}  // namespace pendula::integrate
