// Light folding: what make() does before it interns a node.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula {

/// The simpler expression that op(a, b, c) is, or nothing. Only rewritings that neither reorder
/// floating-point work nor change the value: constants, neutral elements, signs, x - x, x + x, x·x. Throws
/// Error where constants have no real result (1/0, sqrt(-1), log(0)).
std::optional<Expr> fold(Op op, Expr a, Expr b, Expr c);

/// The last trial divisor for squares and primes in numbers: a choice; numbers that people write have small
/// ones, and a thousand divisions take microseconds.
inline constexpr unsigned long largest_trial_divisor = 1000;

/// The decimal number that was meant by a double: the shortest one that reads as it, if that has at
/// most 15 digits (3e-9 is 3/10⁹, at any exponent); else one of at most ten digits within two units of
/// the last place, as arithmetic on such numbers leaves it (0.1 + 0.2 is 3/10). Nothing for other
/// doubles (π, 5.551115123125783e-17).
std::optional<mpq_class> typed_decimal(double value);

}  // namespace pendula
