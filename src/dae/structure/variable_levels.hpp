// How deep the hidden constraints are that each unknown of a DAE follows from.
#pragma once

#include <vector>

#include "dae/structure/sigma.hpp"

namespace pendula::dae {

/// Per variable j, the number C_j such that x_j^(k) contains errors of the equations differentiated up to
/// k + C_j - d_j times: the highest c_i of the equations that determine x_j^(d_j). A variable that depends on
/// x_j by its (d_j - g)-th derivative gets C_j - g only. In a model that is one block all are max c (Hairer &
/// Wanner II, §VII.4). Requires offsets without unmatched equations. Cost: O(nnz max c) at most.
std::vector<int> variable_levels(const Signature& sigma, const Offsets& offsets);

}  // namespace pendula::dae
