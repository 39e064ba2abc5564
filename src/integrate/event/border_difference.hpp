// What two branches of an equation differ by, in parts that can be examined one by one.
//
//   F₊ = x + {p₊ if c, else q}      F₋ = x + {p₋ if c, else q}      p₊ - p₋
//
// Conditions are looked through, and factors and divisors that both have in common: a difference behind five
// nested conditions is not 0 because random values of these seldom lead to it. Common terms are left out:
// added to x of size 1, a jump of 10⁻¹⁸ would be lost to rounding.
#pragma once

#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::integrate {

/// Expressions from which above - below takes its value, each chosen or not by conditions: it is 0 where all
/// of them are. None if both are the same. Beyond 200 conditions some are left inside of a part. Cost: linear
/// in the nodes in which they differ, times the conditions that only one of them has.
std::vector<Expr> differences(Expr above, Expr below);

}  // namespace pendula::integrate
