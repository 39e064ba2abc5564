// Functions for four AVX2 lanes. This file is compiled for AVX2.
#include "codegen/machine/functions.hpp"

#if defined(PENDULA_SLEEF) && defined(__AVX2__)
#include "codegen/machine/lane_functions.hpp"

namespace pendula::codegen {
const void* lane_function4(Op op) {
  using Vector = __m256d;
  switch (op) {
#define OP(name, arity, style, parity, exact, code, ...) PENDULA_LANE_##code(name, 4, avx2)
#include "expr/ops.def"
#undef OP
    default:
      return nullptr;  // a few machine instructions, or a linear system
  }
}
}  // namespace pendula::codegen

#else

namespace pendula::codegen {
const void* lane_function4(Op) { return nullptr; }
}  // namespace pendula::codegen

#endif
