// Equations that hold nowhere.
#pragma once

#include "dae/model/model.hpp"

namespace pendula::dae {

/// "equation (2) 0 = exp(x) + 1 has no solution", or the fewest equations that have none in common, where
/// interval arithmetic proves it, or one that holds only where its gradient vanishes, x² + y² = 0; else "".
/// Of up to 500 equations, together up to 60.
std::string why_unsolvable(const Model& model);

}  // namespace pendula::dae
