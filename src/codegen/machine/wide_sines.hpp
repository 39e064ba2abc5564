// Sines and cosines of different angles, four angles in one call.
#pragma once

#include "codegen/program/program.hpp"

namespace pendula::codegen {

/// The same program, in another order, in which sines and cosines of angles that are known at one time are
/// wide instructions: sin and cos of one gather, one behind the other. The program itself where there is no
/// second angle. Only for Machine with one lane, where there is a wide_sincos_function(). Cost: linear.
Program with_wide_sines(const Program& program);

}  // namespace pendula::codegen
