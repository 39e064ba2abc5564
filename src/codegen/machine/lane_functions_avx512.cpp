// Functions for eight AVX-512 lanes. This file is compiled for AVX-512.
#include "codegen/machine/functions.hpp"

#if defined(PENDULA_SLEEF) && defined(__AVX512F__)
#include "codegen/machine/lane_functions.hpp"

namespace pendula::codegen {
const void* lane_function8(Op op) {
  using Vector = __m512d;
  switch (op) {
#define OP(name, arity, style, parity, exact, code, ...) PENDULA_LANE_##code(name, 8, avx512f)
#include "expr/ops.def"
#undef OP
    default:
      return nullptr;  // a few machine instructions, or a linear system
  }
}
}  // namespace pendula::codegen

#else

namespace pendula::codegen {
const void* lane_function8(Op) { return nullptr; }
}  // namespace pendula::codegen

#endif
