// How deep the hidden constraints are that each unknown of a DAE follows from.
#pragma once

#include <vector>

#include "dae/structure/sigma.hpp"

namespace pendula::dae {

/// Per variable j, the number C_j such that an error in the equations, differentiated up to k + C_j - d_j times, stands in
/// x_j^(k): the highest c_i of the equations that x_j^(d_j) follows from. What depends on x_j by a derivative g below
/// x_j^(d_j) follows from C_j - g only. In a model that is one block all are max c (Hairer & Wanner II, §VII.4).
/// Requires offsets without unmatched equations. Cost: O(nnz max c) at most.
std::vector<int> variable_levels(const Signature& sigma, const Offsets& offsets);

}  // namespace pendula::dae
