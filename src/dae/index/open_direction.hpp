// What the derivative array determines, shown by one direction: for arrays too large for dense ranks
// (docs/derivations.md#derivative-array).
#pragma once

#include <optional>

#include "dae/points/derivative_array.hpp"

namespace pendula::dae {

/// Points of F_k = 0 by what F_k says of x′ there, to rounding.
///
/// open: a vector v with ∂F_k/∂(x′, x″ …) v = 0 has a part in x′.
/// determined: cᵀx′, c random, is a combination of the rows. Then all of x′ is one: the c of which this is
/// true form a subspace, and a random vector lies in the whole space only.
struct DirectionCount {
  int open = 0, determined = 0;
};

/// Of up to `wanted` points. That fewer are found proves nothing. Cost: some ten sparse least-squares
/// solutions for each.
DirectionCount count_directions(const DerivativeArray& array, int wanted);

/// Index and degrees of freedom where two points agree: F_k determines x′, F_{k-1} leaves a direction open.
struct DirectionIndex {
  int index, dof;
};
/// Nothing where the points say neither, up to F_most. Cost: as above for each k, and two sparse QR.
std::optional<DirectionIndex> index_by_directions(DerivativeArray array, int most);

}  // namespace pendula::dae
