// Sums of squares behind quadratic equations.
#pragma once

#include <optional>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// x² + x y + y² as (x + y/2)² + 3 y²/4 (Lagrange's reduction): completes the square of each unknown in turn
/// in which e is quadratic with a constant factor. Interval bounds of the result are sharp, those of e,
/// where x occurs twice, are not.
///
/// returns   the same function, written so; nothing where it has no square, or is long
/// cost      two derivatives and a simplification for each of at most 8 unknowns
std::optional<Expr> with_completed_squares(Expr e);

}  // namespace pendula::dae
