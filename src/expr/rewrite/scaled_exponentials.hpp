// Quotients and logarithms of exponentials that stay numbers where the exponentials are infinite.
//
//   1/(1 + eᵘ)  has the derivative  -eᵘ u′/(1 + eᵘ)²      ∞/∞ beyond u = 709
//   log(1 + eᵘ)                                           ∞ there, but u to rounding
//   (2 e²ᵘ + eᵘ)/(e²ᵘ + eᵘ)                               0/0 below u = -745, but 1
//
// In such expressions each value is carried as v eˢ, with numbers v of ordinary size: eᵘ as e^min(u, 40)
// with s = max(u - 40, 0). Products add s, sums take the larger one, and the result is v eˢ, or s + log v.
// Where no exponent is beyond ±40, s is 0 and results keep their bits.
//
// see  docs/derivations.md#exponentials-that-overflow
#pragma once

#include <span>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula {

/// The same outputs for evaluation in double numbers. Scaled are
///   - sums, products, quotients and constant powers in which exp, sinh or cosh are in a divisor and in what
///     is divided by it; exponents below -40, too, where all terms of a divisor have exponentials;
///   - logarithms of expressions in which any of these are, with exponents below -40.
/// Other expressions stay as they are. Cost: linear in the graph, plus the exponents once more.
std::vector<Expr> with_scaled_exponentials(std::span<const Expr> outputs);

}  // namespace pendula
