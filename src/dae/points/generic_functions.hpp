// Unspecified functions f(x, y) replaced by functions that can be evaluated.
#pragma once

#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// Every unspecified function replaced by a smooth one without special properties, the same for equal names.
std::vector<Expr> without_calls(std::vector<Expr> e);

}  // namespace pendula::dae
