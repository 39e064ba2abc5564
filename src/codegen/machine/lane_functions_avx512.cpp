// Functions for eight AVX-512 lanes. This file is compiled for AVX-512.
#include "codegen/machine/functions.hpp"

#if defined(PENDULA_SLEEF) && defined(__AVX512F__)
#include "codegen/machine/lane_functions.hpp"

namespace pendula::codegen {
const void* lane_function8(Op op) { PENDULA_LANE_FUNCTIONS(__m512d, 8, avx512f) }
}  // namespace pendula::codegen

#else

namespace pendula::codegen {
const void* lane_function8(Op) { return nullptr; }
}  // namespace pendula::codegen

#endif
