// Functions for four AVX2 lanes, and for one. This file is compiled for AVX2.
#include "codegen/machine/functions.hpp"

#include <cmath>

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

static bool has_lanes() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
double lane_log(double a) {
  static const bool lanes = has_lanes();
  return lanes ? Sleef_finz_logd1_u10purecfma(a) : std::log(a);
}
double lane_exp(double a) {
  static const bool lanes = has_lanes();
  return lanes ? Sleef_finz_expd1_u10purecfma(a) : std::exp(a);
}
}  // namespace pendula::codegen

#else

namespace pendula::codegen {
const void* lane_function4(Op) { return nullptr; }
double lane_log(double a) { return std::log(a); }
double lane_exp(double a) { return std::exp(a); }
}  // namespace pendula::codegen

#endif
