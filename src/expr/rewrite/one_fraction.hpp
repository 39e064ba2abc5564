// Fractions inside fractions, and quotients by a sum inside a sum, as one fraction.
#pragma once

#include "expr/graph/graph.hpp"

namespace pendula {

/// m R²/(m R² + J) for 1 - J/(m R² + J) and m₁ m₂/(m₁ + m₂) for 1/(1/m₁ + 1/m₂), where that is not
/// much longer; else e. 2 ω v + (ω² - g/l) x stays: its denominators are no sums; a sum a/(b + c) - g
/// stays where the fraction is longer.
///
/// requires  e is simplified
Expr one_fraction(Expr e);

}  // namespace pendula
