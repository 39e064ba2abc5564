// Light folding: what make() does before it interns a node.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula {

/// The simpler expression that op(a, b, c) is, or nothing. Only rewritings that neither reorder
/// floating-point work nor change the value: constants, neutral elements, signs, x - x, x + x, x·x. Throws
/// Error where constants have no real result (1/0, sqrt(-1), log(0)).
std::optional<Expr> fold(Op op, Expr a, Expr b, Expr c);

}  // namespace pendula
