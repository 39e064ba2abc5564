// The values of the schoolbook: sin, cos and tan at multiples of π/5, π/8, π/10 and π/12, and their inverses.
#pragma once

#include <optional>

#include "expr/graph/graph.hpp"

namespace pendula {

/// q where e is q π with a rational q; nothing for everything else. 0 is 0 π.
std::optional<mpq_class> half_turns(Expr e);

/// sin, cos or tan of q π where it is a schoolbook value: 0, 1/2, √2/2, (1 + √5)/4, √(2 - √2)/2, … with their
/// signs. Throws Error for tan at its poles.
std::optional<Expr> trigonometric_value(Op op, const mpq_class& half_turns);

/// asin, acos or atan of a rational number where it is a simple multiple of π.
std::optional<Expr> known_angle(Op op, const mpq_class& value);

}  // namespace pendula
