// Simplification within a budget.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula {

/// Written out as a tree, e has at most `nodes` operations. 1000: those that simplify takes milliseconds for.
bool is_short(Expr e, double nodes = 1000);
/// simplify(e) where that is quick, else e.
Expr tidied(Expr e);

}  // namespace pendula
