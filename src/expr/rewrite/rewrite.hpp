// simplify and expand: for what people read. Both keep the value wherever the original
// is defined, and are idempotent.
//
// rewrite.hpp (here): the two functions; rewrite_rules.cpp, rewrite_products.cpp, rewrite_sums.cpp: the
// rules, by what they apply to; rewrite_forms.hpp: the collected forms they work on;
// rewrite_patterns.hpp: equal expressions of other variables are rewritten once. tidied.hpp: within a
// budget; one_fraction.hpp, vanishing_parts.hpp: two rewritings that other folders ask for by themselves;
// assumption.hpp: what is known about a symbol.
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
