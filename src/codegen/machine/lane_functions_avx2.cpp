// Functions for four AVX2 lanes. This file is compiled for AVX2.
#include "codegen/machine/functions.hpp"

#if defined(PENDULA_SLEEF) && defined(__AVX2__)
#include "codegen/machine/lane_functions.hpp"

namespace pendula::codegen {
const void* lane_function4(Op op) { PENDULA_LANE_FUNCTIONS(__m256d, 4, avx2) }
}  // namespace pendula::codegen

#else

namespace pendula::codegen {
const void* lane_function4(Op) { return nullptr; }
}  // namespace pendula::codegen

#endif
