// The decimal that a reader at the prompt wants beside √2/2 or π/3.
#pragma once

#include <string>

#include "expr/graph/graph.hpp"

namespace pendula {

/// "≈ 0.7071067812" for a number with roots, π or functions in it; "" for everything that is no such number:
/// rational numbers, expressions with symbols, what has no finite value.
std::string decimal_approximation(Expr e);

}  // namespace pendula
