#include "integrate/solve/vector_sums.hpp"

#include <algorithm>

#include "base/four.hpp"

namespace pendula::integrate {
namespace {

[[gnu::always_inline]] inline void combined(int n, const double* base, std::span<const double> weights,
                                            const double* from, std::ptrdiff_t stride, double* out) {
  constexpr int wide = 16, parts = 4;
  int k = 0;
  for (; k + wide <= n; k += wide) {
    Four sum[parts] = {};
    if (base) {
#pragma GCC unroll 4
      for (int l = 0; l < parts; ++l) load(sum[l], base + k + 4 * l);
    }
    const double* at = from + k;
    for (const double w : weights) {
#pragma GCC unroll 4
      for (int l = 0; l < parts; ++l) {
        Four part;
        load(part, at + 4 * l);
        sum[l] += w * part;
      }
      at += stride;
    }
#pragma GCC unroll 4
    for (int l = 0; l < parts; ++l) store(out + k + 4 * l, sum[l]);
  }
  for (; k < n; ++k) {
    double sum = base ? base[k] : 0;
    for (std::size_t j = 0; j < weights.size(); ++j)
      sum += weights[j] * from[static_cast<std::ptrdiff_t>(j) * stride + k];
    out[k] = sum;
  }
}

[[gnu::always_inline]] inline void applied(int n, double* to, const double* change,
                                           const double* inverse_scale, double& sum, double& largest) {
  Four sums = {}, most = {};
  int k = 0;
  for (; k + 4 <= n; k += 4) {
    Four d, scale, old;
    load(d, change + k);
    load(scale, inverse_scale + k);
    load(old, to + k);
    store(to + k, old + d);
    const Four scaled = d * scale, square = scaled * scaled;
    sums += square;
    most = square > most ? square : most;
  }
  for (int l = 0; l < 4; ++l) {
    sum += sums[l];
    largest = std::max(largest, most[l]);
  }
  for (; k < n; ++k) {
    const double scaled = change[k] * inverse_scale[k];
    to[k] += change[k];
    sum += scaled * scaled;
    largest = std::max(largest, scaled * scaled);
  }
}

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("avx2")]] void combine_avx2(int n, const double* base, std::span<const double> weights,
                                          const double* from, std::ptrdiff_t stride, double* out) {
  combined(n, base, weights, from, stride, out);
}
[[gnu::target("avx2")]] void apply_avx2(int n, double* to, const double* change, const double* inverse_scale,
                                        double& sum, double& largest) {
  applied(n, to, change, inverse_scale, sum, largest);
}
const bool has_avx2 = __builtin_cpu_supports("avx2");
#endif

}  // namespace

void combine(int n, const double* base, std::span<const double> weights, const double* from,
             std::ptrdiff_t stride, double* out) {
#if defined(__x86_64__) && defined(__GNUC__)
  if (has_avx2) return combine_avx2(n, base, weights, from, stride, out);
#endif
  combined(n, base, weights, from, stride, out);
}

void apply(int n, double* to, const double* change, const double* inverse_scale, double& sum,
           double& largest) {
#if defined(__x86_64__) && defined(__GNUC__)
  if (has_avx2) return apply_avx2(n, to, change, inverse_scale, sum, largest);
#endif
  applied(n, to, change, inverse_scale, sum, largest);
}

}  // namespace pendula::integrate
