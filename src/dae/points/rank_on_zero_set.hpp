// Where r(y, z) = 0 holds: is ∂r/∂z regular there? What the implicit function theorem asks.
#pragma once

#include <vector>

#include "expr/graph/derivative.hpp"

namespace pendula::dae {

/// Points of {r = 0} at which the rank of ∂r/∂z was looked at.
struct ZeroSetRanks {
  int regular = 0;   ///< full rank
  int singular = 0;  ///< less, or reached by Newton's method at a linear rate only (a multiple root)
};

/// As many rows as entries of z. Some points, from seeded values of y, z and of everything else; unspecified
/// functions take values of their own. None is found where r = 0 has no solution near. Cost: a few Newton
/// iterations of the size of z.
ZeroSetRanks rank_on_zero_set(const std::vector<Expr>& r, const std::vector<Expr>& z);

}  // namespace pendula::dae
