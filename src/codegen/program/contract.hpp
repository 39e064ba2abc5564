// Contractions, fast and not exact to the last bit: products and sums in one operation, reciprocals.
#pragma once

#include "codegen/program/program.hpp"

namespace pendula::codegen {

/// The program with a·b + c, a·b - c and c - a·b in place of the two operations, where the product has no
/// other use, and with products in place of divisions by constants and by what divides several times. Its
/// results differ from those of the program by a rounding of each of these products. Only for
/// Machine with Rounding::fused: the tape does not know these operations. Cost: linear.
Program contracted(const Program& program);

/// Only the products in place of divisions: for the right-hand sides of differential equations, in which
/// forces that fall with distance divide every component by the same power. Cost: linear.
Program with_shared_reciprocals(const Program& program);

}  // namespace pendula::codegen
