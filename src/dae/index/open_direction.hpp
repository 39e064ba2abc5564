// What the derivative array determines, shown by one direction: for arrays too large for dense ranks.
#pragma once

#include "dae/points/derivative_array.hpp"

namespace pendula::dae {

/// Points of F_k = 0 by what F_k says of x′ there.
struct DirectionCount {
  int open = 0;        ///< a vector v with ∂F_k/∂(x′, x″ …) v = 0 has a part in x′
  int determined = 0;  ///< a random cᵀx′ is a combination of the rows: all of x′ is, since those that are form
                       ///< a subspace, which a random c lies in if it is the whole space only
};

/// Of up to `wanted` points; both to rounding. That fewer are found proves nothing. Cost: some ten sparse
/// least-squares solutions for each.
DirectionCount count_directions(const DerivativeArray& array, int wanted);

}  // namespace pendula::dae
