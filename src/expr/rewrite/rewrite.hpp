// simplify and expand: for what people read. Both keep the value wherever the original
// is defined and are idempotent.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula {

/// Collects like terms and powers, cancels common factors, applies the rules of rewrite.cpp (sin² + cos² = 1,
/// log(exp x) = x, …), and keeps the shorter of the factored and the expanded form. Cost: bounded;
/// expressions too large for a collected form are simplified node by node.
Expr simplify(Expr e);

/// Multiplies out products of sums and integer powers of sums. Throws Error beyond 100 000 terms.
Expr expand(Expr e);

}  // namespace pendula
