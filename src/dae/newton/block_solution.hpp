// Square linear systems block by block, in the order in which blocks determine their unknowns. Units of
// unknowns and equations matter within a block only: exp(d/V) beside d has slopes many orders apart from one
// end of a start to the other, and rows in whose largest entries the unknowns are known already look alike.
#pragma once

#include <optional>

#include "base/math.hpp"

namespace pendula::dae {

/// x with A x = b. Nothing where A is not square, or a block of it is nearly singular in balanced units.
std::optional<Vec> solve_by_blocks(const Mat& A, const Vec& b);
/// The same, or the least x in balanced units for which A x - b is least in them.
Vec balanced_solution(Mat A, const Vec& b);

}  // namespace pendula::dae
