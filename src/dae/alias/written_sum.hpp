// Sums of unknowns with coefficients as one would write them.
#pragma once

#include <utility>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// Is it written with a minus?
bool is_negative(Expr c);

/// sum - Σ c x for terms (c, x). Unknowns whose coefficients share a summand stand together:
/// (u - v)/R + (w - v)/S and not u/R - (1/R + 1/S) v + w/S, which costs more, and rounds large numbers before
/// it subtracts them. The first unknown of such a difference is positive, so that what flows from u to v is
/// the same expression where it leaves and where it arrives.
Expr without_terms(Expr sum, const std::vector<std::pair<Expr, Expr>>& terms);

}  // namespace pendula::dae
