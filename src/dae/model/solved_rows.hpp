// Equations that are solved for a derivative: x_j′ = f.
#pragma once

#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// An equation solved for a first derivative: x_j′ = f.
struct Solved {
  std::size_t residual;
  Expr derivative;  ///< the top derivative leaf
  Expr f;
  Expr slope = 1;  ///< its coefficient in the row, which f was divided by
};
/// Rows that contain one top derivative, linearly, with a coefficient free of
/// unknowns; each derivative at most once.
std::vector<Solved> solved_rows(const Model& model);

/// x_j⁽ᵏ⁾ = f, row by row, and no such derivative in any f. Cost: one pass over all f together.
bool is_explicit_ode(const Model& model);

}  // namespace pendula::dae
