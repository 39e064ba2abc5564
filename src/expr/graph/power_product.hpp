// Products for the chain rule in which roots cancel: (a·√a)′ = √a a′ + a·(a′/(2 √a)) is 0/0 at a = 0 as it
// stands, and 3/2 √a a′ = 0 when the powers of a are added.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula {

/// √a, or a power of a with a fraction for exponent, of an a that is not constant.
bool is_root(Expr e);

/// x·y. Where one of them has a factor 1/√a, or another negative fractional power, and the other one a
/// positive power of the same a, their exponents are added (both have a value for a > 0 only); sums with such
/// a term are multiplied term by term. Else the plain product.
Expr cancelled_product(Expr x, Expr y);

}  // namespace pendula
