// The rounding of doubles as one number.
#pragma once

namespace pendula {

/// Distance from 1 to the next double; twice the largest relative error of one rounding.
inline constexpr double eps = 0x1p-52;

}  // namespace pendula
