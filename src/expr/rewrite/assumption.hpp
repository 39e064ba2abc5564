// Assumptions about a symbol: that it is greater than 0, as masses, lengths and stiffnesses are.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula {

/// Requires a symbol. Only simplify uses it: |m| = m, √(m²) = m.
void assume_positive(Expr leaf, bool positive);
/// π is positive by itself.
bool is_assumed_positive(Expr leaf);
/// Changes with every assumption, so that what was simplified under others is not used again.
std::size_t assumptions_made();

}  // namespace pendula
