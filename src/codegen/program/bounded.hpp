// Quotients of exponentials that stay numbers where the exponentials are infinite.
//
//   r = 1/(1 + eᵘ),  r′ = -eᵘ u′/(1 + eᵘ)²      At u = 710, eᵘ is infinite: r is 0, and r′ would be ∞/∞.
//
// In such a product eᵘ is bounded, by 10¹⁵⁴ here, in the dividend and in the divisor: finite results keep
// their bits, and beyond the bound the quotient is its limit. docs/derivations.md#exponentials-that-overflow.
#pragma once

#include <span>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::codegen {

/// The same outputs with such products bounded: those whose factors exp u, sinh u, cosh u, or sums of
/// multiples of these, of exp(-u), of numbers and of parameters (taken to be of ordinary size), are in
/// the divisor at least as often as in the dividend. Other products stay. Cost: linear in the graph, plus
/// the bounded products once more.
std::vector<Expr> bounded_quotients(std::span<const Expr> outputs);

}  // namespace pendula::codegen
