// This file is compiled for AVX2.
#include "codegen/functions.hpp"

#if defined(PENDULA_SLEEF) && defined(__AVX2__)
#include <immintrin.h>

#include "codegen/lane_product_body.hpp"

namespace pendula::codegen {
namespace {

struct Eight {
  __m256d low, high;
  static Eight broadcast(double a) { return {_mm256_set1_pd(a), _mm256_set1_pd(a)}; }
  static Eight load(const double* low, const double* high) {
    return {_mm256_loadu_pd(low), _mm256_loadu_pd(high)};
  }
  void store(double* to_low, double* to_high) const {
    _mm256_storeu_pd(to_low, low), _mm256_storeu_pd(to_high, high);
  }
  static Eight fma(Eight a, Eight b, Eight c) {
    return {_mm256_fmadd_pd(a.low, b.low, c.low), _mm256_fmadd_pd(a.high, b.high, c.high)};
  }
  static Eight max(Eight a, Eight b) { return {_mm256_max_pd(a.low, b.low), _mm256_max_pd(a.high, b.high)}; }
  double sum() const {
    const __m256d s = _mm256_add_pd(low, high);
    return (s[0] + s[1]) + (s[2] + s[3]);
  }
  double largest() const {
    const __m256d m = _mm256_max_pd(low, high);
    return std::max(std::max(m[0], m[1]), std::max(m[2], m[3]));
  }
};

}  // namespace

LaneProduct lane_product4() { return {assign_lanes<Eight>, add_lanes<Eight>}; }

}  // namespace pendula::codegen
#else

namespace pendula::codegen {
LaneProduct lane_product4() { return {}; }
}  // namespace pendula::codegen

#endif
