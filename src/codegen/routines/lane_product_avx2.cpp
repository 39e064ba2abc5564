// This file is compiled for AVX2.
#include "codegen/routines/lane_product.hpp"

#include <algorithm>

#if defined(PENDULA_SLEEF) && defined(__AVX2__)
#include <immintrin.h>

namespace pendula::codegen {
namespace {

/// Rows 0 … 3, or all eight, of the product for `block` consecutive k, so that the columns are read
/// once for all.
template <int halves, std::size_t block>
struct Sums {
  __m256d value[halves][block];

  Sums(const LaneTerms& q, std::size_t k) {
    for (auto& half : value)
      for (__m256d& sum : half) sum = _mm256_setzero_pd();
    const double *const *from = q.from, *column = q.columns;
    const std::size_t stride = q.stride, first = stride * k;
    for (const auto last = from + q.count; from != last; ++from, column += 8) {
      const double* const row = *from + first;
      __m256d factor[halves];
      for (int h = 0; h < halves; ++h) factor[h] = _mm256_load_pd(column + 4 * h);
      for (std::size_t b = 0; b < block; ++b) {
        const __m256d number = _mm256_broadcast_sd(row + stride * b);
        for (int h = 0; h < halves; ++h) value[h][b] = _mm256_fmadd_pd(factor[h], number, value[h][b]);
      }
    }
  }
};

template <int halves, std::size_t block, class Use>
void use_sums(const LaneTerms& q, const LaneRows& to, std::size_t k, const Use& use) {
  const Sums<halves, block> sums(q, k);
  double *low = to.low + to.stride * k, *high = halves > 1 ? to.high + to.stride * k : nullptr;
  const std::size_t stride = to.stride;
  for (std::size_t b = 0; b < block; ++b, low += stride) {
    use(k + b, sums.value[0][b], low);
    if constexpr (halves > 1) {
      use(k + b, sums.value[1][b], high);
      high += stride;
    }
  }
}

/// Calls use(k, four sums, their destination) for all k. Several sums at once hide each other's latency.
template <int halves, class Use>
void for_all_sums(const LaneTerms& q, const LaneRows& to, const Use& use) {
  constexpr std::size_t block = 4;
  std::size_t k = 0;
  for (; k + block <= q.size; k += block) use_sums<halves, block>(q, to, k, use);
  switch (q.size - k) {
    case 3:
      return use_sums<halves, 3>(q, to, k, use);
    case 2:
      return use_sums<halves, 2>(q, to, k, use);
    case 1:
      return use_sums<halves, 1>(q, to, k, use);
    default:
      return;
  }
}

template <class Use>
void for_all_sums(const LaneTerms& q, const LaneRows& to, const Use& use) {
  to.high ? for_all_sums<2>(q, to, use) : for_all_sums<1>(q, to, use);
}

}  // namespace

void assign_lane_product(const LaneTerms& terms, const LaneRows& to) {
  for_all_sums(terms, to, [](std::size_t, __m256d sum, double* at) { _mm256_storeu_pd(at, sum); });
}

void add_lane_product(const LaneTerms& terms, const double* scale, const LaneRows& to, double& sum,
                      double& largest) {
  __m256d squares = _mm256_setzero_pd(), most = squares;
  for_all_sums(terms, to, [&](std::size_t k, __m256d change, double* at) {
    _mm256_storeu_pd(at, _mm256_add_pd(change, _mm256_loadu_pd(at)));
    const __m256d scaled = _mm256_mul_pd(change, _mm256_broadcast_sd(scale + k));
    const __m256d square = _mm256_mul_pd(scaled, scaled);
    squares = _mm256_add_pd(squares, square);
    most = _mm256_max_pd(square, most);
  });
  sum = (squares[0] + squares[1]) + (squares[2] + squares[3]);
  largest = std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
}

}  // namespace pendula::codegen
#else

namespace pendula::codegen {
void assign_lane_product(const LaneTerms&, const LaneRows&) {}
void add_lane_product(const LaneTerms&, const double*, const LaneRows&, double&, double&) {}
}  // namespace pendula::codegen

#endif
