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

/// Factors of columns for which, with others for the rows, the logarithms of all entries are least in the
/// sense of least squares. Products of units along a chain need them: where x_k is 10⁶ times x_{k+1} in each
/// of three equations, elimination may divide by a pivot of 10⁻¹⁸ of its row. One entry that is rounding in
/// place of 0 spoils them, which column_scale() does not notice. Empty as above, and where the products of n
/// entries are too near to each other for units to matter.
std::vector<double> balanced_column_scale(int n, std::span<const Position> positions,
                                          std::span<const double> sizes);

}  // namespace pendula::integrate
