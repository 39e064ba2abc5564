// This file is compiled for AVX-512.
#include "codegen/functions.hpp"

#if defined(PENDULA_SLEEF) && defined(__AVX512F__)
#include <immintrin.h>

#include "codegen/lane_product_body.hpp"

namespace pendula::codegen {
namespace {

struct Eight {
  __m512d all;
  static Eight broadcast(double a) { return {_mm512_set1_pd(a)}; }
  static Eight load(const double* low, const double*) { return {_mm512_loadu_pd(low)}; }
  void store(double* low, double*) const { _mm512_storeu_pd(low, all); }
  static Eight fma(Eight a, Eight b, Eight c) { return {_mm512_fmadd_pd(a.all, b.all, c.all)}; }
  static Eight max(Eight a, Eight b) { return {_mm512_max_pd(a.all, b.all)}; }
  double sum() const { return _mm512_reduce_add_pd(all); }
  double largest() const { return _mm512_reduce_max_pd(all); }
};

}  // namespace

LaneProduct lane_product8() { return {assign_lanes<Eight>, add_lanes<Eight>}; }

}  // namespace pendula::codegen
#else

namespace pendula::codegen {
LaneProduct lane_product8() { return {}; }
}  // namespace pendula::codegen

#endif
