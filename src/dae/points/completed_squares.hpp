// Sums of squares behind quadratic equations.
#pragma once

#include <optional>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// x² + x y + y² as (x + y/2)² + 3 y²/4: for one unknown after the other in which e is quadratic with a constant factor,
/// its terms as one square (Lagrange's reduction), the rest last. Unlike e, where x occurs twice, its bounds are sharp.
///
/// returns   the same function, written so; nothing where it has no square, or is long
/// cost      two derivatives and a simplification for each of at most 8 unknowns
std::optional<Expr> with_completed_squares(Expr e);

}  // namespace pendula::dae
