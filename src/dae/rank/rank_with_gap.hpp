// Numeric rank with the gap of singular values that decided it.
#pragma once

#include "base/math.hpp"

namespace pendula::dae {

/// Rows and columns divided by their largest entries, three times in turn: ranks must not depend on units.
Mat equilibrated(Mat m);

struct RankGap {
  int rank = 0;
  double gap = 0;  ///< σ_r / σ_{r+1}, rounding level taken as the least σ; a lower bound where QR proves it
};
constexpr double clear_gap = 1e6;  ///< between singular values that count and those that do not

/// Rank after equilibration of rows and columns, cut at the widest gap of singular values below 1e-8 σ₁: by a
/// QR factorisation with pivoting where its bounds show that gap, by the singular values elsewhere. Cost:
/// O(r c min(r, c)), ten times less where QR is enough.
RankGap rank_with_gap(const Mat& m);

}  // namespace pendula::dae
