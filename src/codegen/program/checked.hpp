// Programs that solve systems of saddle_solution() without pivots, and say whether that was right.
#pragma once

#include "codegen/program/program.hpp"

namespace pendula::codegen {

/// lower(), and where there are such systems one more result: 1 where no pivot was needed at the point at
/// hand (symmetric.hpp), 0 where the other results may not be used. lower() itself takes pivots.
Program lower_checked(std::span<const Expr> outputs, std::span<const Expr> inputs);

}  // namespace pendula::codegen
