// Quotients of exponentials that stay numbers where the exponentials are infinite.
//
//   r = 1/(1 + eᵘ),  r′ = -eᵘ u′/(1 + eᵘ)²      At u = 710, eᵘ is infinite: r is 0, and r′ would be ∞/∞.
//
// In such a product eᵘ is held at a bound, 10¹⁵⁴ here, in the dividend and in the divisor: what is a number keeps its bits,
// and beyond the bound the quotient is its limit. docs/derivations.md#exponentials-that-overflow.
#pragma once

#include <span>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::codegen {

/// The same outputs with such products bounded: factors that are exp u, sinh u or cosh u, or sums of multiples of it, of
/// exp(-u), and of numbers and parameters, which are taken to be of usual size; in the divisor at least as often as in the
/// dividend. Others are as they were. Cost: linear in the graph, and the products that are bounded once more.
std::vector<Expr> bounded_quotients(std::span<const Expr> outputs);

}  // namespace pendula::codegen
