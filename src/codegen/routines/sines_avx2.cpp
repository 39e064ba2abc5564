// This file is compiled for AVX2.
#include "codegen/routines/sines.hpp"

#if defined(PENDULA_SLEEF) && defined(__AVX2__)
#include <immintrin.h>
#include <sleef.h>

namespace pendula::codegen {

static void four(__m256d a, double* sin, double* cos) {
  const auto both = Sleef_finz_sincosd4_u10avx2(a);
  _mm256_storeu_pd(sin, both.x);
  _mm256_storeu_pd(cos, both.y);
}

const void* wide_sincos_function() {
  const bool lanes = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return lanes ? reinterpret_cast<const void*>(four) : nullptr;
}
SinCos lane_sincos(double a) {
  const auto both = Sleef_finz_sincosd1_u10purecfma(a);
  return {both.x, both.y};
}
void wide_sincos(const double* a, double* sin, double* cos) { four(_mm256_loadu_pd(a), sin, cos); }

}  // namespace pendula::codegen

#else

namespace pendula::codegen {
const void* wide_sincos_function() { return nullptr; }
SinCos lane_sincos(double a) { return {a, a}; }
void wide_sincos(const double*, double*, double*) {}
}  // namespace pendula::codegen

#endif
