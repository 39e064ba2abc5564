// Units of unknowns: factors for the columns of a matrix.
#pragma once

#include <span>
#include <vector>

#include "integrate/solve/band_lu.hpp"

namespace pendula::integrate {

/// Factors after which the largest entry of every column, relative to the largest of its row, is 1:
/// multipliers of constraints between lengths in nanometres have entries far from those of other unknowns.
/// sizes: of the entries at `positions`. Empty where a column is zero or a size is not finite.
std::vector<double> column_scale(int n, std::span<const Position> positions, std::span<const double> sizes);

}  // namespace pendula::integrate
