#include "integrate/solve/stage_sums.hpp"

#include <cstddef>

#include "base/four.hpp"

namespace pendula::integrate {
namespace {

/// out[k] = x[k] + h Σ aⱼ Kⱼ[k] from k on, in groups of `parts` adjacent vectors, so that the sums stay in
/// registers. Returns the first k that is left.
template <int parts, class Vector>
[[gnu::always_inline]] inline int combined_wide(int k, int n, const double* x, double h, const StageRow& row,
                                                const double* K, double* out) {
  constexpr int width = sizeof(Vector) / sizeof(double), wide = width * parts;
  for (; k + wide <= n; k += wide) {
    Vector sum[parts] = {};
    Vector part;
    for (const StageTerm& term : row) {
      const double* Kj = K + static_cast<std::ptrdiff_t>(term.stage) * n + k;
#pragma GCC unroll 4
      for (int l = 0; l < parts; ++l) {
        load(part, Kj + width * l);
        sum[l] += term.factor * part;
      }
    }
#pragma GCC unroll 4
    for (int l = 0; l < parts; ++l) {
      load(part, x + k + width * l);
      store(out + k + width * l, part + h * sum[l]);
    }
  }
  return k;
}

/// Vector must be as wide as the processor's registers; wider ones are passed through memory.
template <class Vector>
[[gnu::always_inline]] inline void combined(int k, int n, const double* x, double h, const StageRow& row,
                                            const double* K, double* out) {
  k = combined_wide<4, Vector>(k, n, x, h, row, K, out);
  k = combined_wide<2, Vector>(k, n, x, h, row, K, out);
  k = combined_wide<1, Vector>(k, n, x, h, row, K, out);
  k = combined_wide<1, Two>(k, n, x, h, row, K, out);
  for (; k < n; ++k) {
    double sum = 0;
    for (const StageTerm& term : row) sum += term.factor * K[static_cast<std::ptrdiff_t>(term.stage) * n + k];
    out[k] = x[k] + h * sum;
  }
}

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("avx2")]] void combine_avx2(int n, const double* x, double h, const StageRow& row,
                                          const double* K, double* out) {
  combined<Four>(0, n, x, h, row, K, out);
}
/// Bitwise the same result, eight numbers at a time.
[[gnu::target("avx512f,avx2")]] void combine_avx512(int n, const double* x, double h, const StageRow& row,
                                                    const double* K, double* out) {
  combined<Four>(combined_wide<4, Eight>(0, n, x, h, row, K, out), n, x, h, row, K, out);
}
const bool with_avx2 = __builtin_cpu_supports("avx2"), with_avx512 = __builtin_cpu_supports("avx512f");
#endif

}  // namespace

void add_stages(int n, const double* x, double h, const StageRow& row, const double* K, double* out) {
#if defined(__x86_64__) && defined(__GNUC__)
  constexpr int large = 4, very_large = 128;
  if (n >= very_large && with_avx512) return combine_avx512(n, x, h, row, K, out);
  if (n >= large && with_avx2) return combine_avx2(n, x, h, row, K, out);
#endif
  combined<Two>(0, n, x, h, row, K, out);
}

}  // namespace pendula::integrate
