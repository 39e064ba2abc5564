// Products and sums as one operation with one rounding.
#pragma once

#include "codegen/program.hpp"

namespace pendula::codegen {

/// The program with a·b + c, a·b - c and c - a·b in place of the two operations, where the product has no
/// other use. Its results differ from those of the program by the rounding of these products. Only for
/// Machine with Rounding::fused: the tape does not know these operations. Cost: linear.
Program contracted(const Program& program);

}  // namespace pendula::codegen
