// The rounding of doubles as one number.
#pragma once

namespace pendula {

/// Distance from 1 to the next double; twice the largest relative error of one rounding.
inline constexpr double eps = 0x1p-52;

/// In place of a size that may be 0 and divides, or is multiplied by a tolerance: its reciprocal is finite,
/// and its product with eps is not 0 (the smallest double is 5e-324).
inline constexpr double least_size = 1e-300;

}  // namespace pendula
