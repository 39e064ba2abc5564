#include "integrate/solve/error_sizes.hpp"

#include <algorithm>
#include <cmath>

#include "base/four.hpp"

namespace pendula::integrate {
namespace {

[[gnu::always_inline]] inline void magnitude(Four& x) { x = x < 0 ? -x : x; }
[[gnu::always_inline]] inline void raise(Four& most, const Four& x) { most = x > most ? x : most; }

struct WideSquares {
  Four sum{}, largest{};
  [[gnu::always_inline]] void add(const Four& x) {
    const Four square = x * x;
    sum += square;
    raise(largest, square);
  }
  [[gnu::always_inline]] void move_to(Squares& out) const {
    for (int l = 0; l < 4; ++l) {
      out.sum += sum[l];
      out.largest = std::max(out.largest, largest[l]);
    }
  }
};

void add(Squares& squares, double x) {
  squares.sum += x * x;
  squares.largest = x * x > squares.largest ? x * x : squares.largest;
}

[[gnu::always_inline]] inline void errors(int n, const double* before, const double* after,
                                          const double* atol, const double* rtol, const double* e,
                                          const double* other, double* inverse_weight, double* scaled,
                                          ErrorSizes& out) {
  WideSquares first, second;
  int k = 0;
  for (; k + 4 <= n; k += 4) {
    Four a, b, absolute, relative, error, w;
    load(a, before + k);
    load(b, after + k);
    load(absolute, atol + k);
    load(relative, rtol + k);
    magnitude(a);
    magnitude(b);
    raise(a, b);
    w = 1 / (absolute + relative * a);
    store(inverse_weight + k, w);
    load(error, e + k);
    error *= w;
    store(scaled + k, error);
    first.add(error);
    load(error, other + k);
    second.add(error * w);
  }
  first.move_to(out.first);
  second.move_to(out.second);
  for (; k < n; ++k) {
    const double w = inverse_weight[k] =
        1 / (atol[k] + rtol[k] * std::max(std::fabs(before[k]), std::fabs(after[k])));
    scaled[k] = e[k] * w;
    add(out.first, scaled[k]);
    add(out.second, other[k] * w);
  }
}

[[gnu::always_inline]] inline void changes(int n, const double* a, const double* b, const double* at,
                                           const double* atol, const double* rtol, ChangeSizes& out) {
  Four change{}, size{};
  int k = 0;
  for (; k + 4 <= n; k += 4) {
    Four x, y, w, absolute, relative;
    load(x, a + k);
    load(y, b + k);
    load(w, at + k);
    load(absolute, atol + k);
    load(relative, rtol + k);
    magnitude(w);
    w = 1 / (absolute + relative * w);
    y = (x - y) * w;
    x *= w;
    change += y * y;
    size += x * x;
  }
  for (int l = 0; l < 4; ++l) {
    out.change += change[l];
    out.size += size[l];
  }
  for (; k < n; ++k) {
    const double w = 1 / (atol[k] + rtol[k] * std::fabs(at[k]));
    const double d = (a[k] - b[k]) * w, s = a[k] * w;
    out.change += d * d;
    out.size += s * s;
  }
}

[[gnu::always_inline]] inline void shares(int n, const double* v, const double* at, const double* atol,
                                          const double* rtol, double& out) {
  Four most{};
  int k = 0;
  for (; k + 4 <= n; k += 4) {
    Four x, w, absolute, relative;
    load(x, v + k);
    load(w, at + k);
    load(absolute, atol + k);
    load(relative, rtol + k);
    magnitude(x);
    magnitude(w);
    raise(most, x / (absolute + relative * w));
  }
  for (int l = 0; l < 4; ++l) out = std::max(out, most[l]);
  for (; k < n; ++k) out = std::max(out, std::fabs(v[k]) / (atol[k] + rtol[k] * std::fabs(at[k])));
}

/// 0, or NaN where a number is not finite.
[[gnu::always_inline]] inline double zeros(int n, const double* x) {
  Four first = {}, second = {}, third = {}, fourth = {}, part;
  const auto add = [&](Four& sum, int k) {
    load(part, x + k);
    sum += part * 0;
  };
  int k = 0;
  for (; k + 16 <= n; k += 16) {
    add(first, k);
    add(second, k + 4);
    add(third, k + 8);
    add(fourth, k + 12);
  }
  for (; k + 4 <= n; k += 4) add(first, k);
  double rest = 0;
  for (; k < n; ++k) rest += x[k] * 0;
  const Four sum = (first + second) + (third + fourth);
  return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + rest;
}

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("avx2")]] void errors_avx2(int n, const double* before, const double* after, const double* atol,
                                         const double* rtol, const double* e, const double* other,
                                         double* inverse_weight, double* scaled, ErrorSizes& out) {
  errors(n, before, after, atol, rtol, e, other, inverse_weight, scaled, out);
}
[[gnu::target("avx2")]] void changes_avx2(int n, const double* a, const double* b, const double* at,
                                          const double* atol, const double* rtol, ChangeSizes& out) {
  changes(n, a, b, at, atol, rtol, out);
}
[[gnu::target("avx2")]] void shares_avx2(int n, const double* v, const double* at, const double* atol,
                                         const double* rtol, double& out) {
  shares(n, v, at, atol, rtol, out);
}
[[gnu::target("avx2")]] double zeros_avx2(int n, const double* x) { return zeros(n, x); }
const bool wide = __builtin_cpu_supports("avx2");
#else
constexpr bool wide = false;
constexpr auto errors_avx2 = errors;
constexpr auto changes_avx2 = changes;
constexpr auto shares_avx2 = shares;
constexpr auto zeros_avx2 = zeros;
#endif

}  // namespace

ErrorSizes error_sizes(int n, const double* before, const double* after, const double* atol,
                       const double* rtol, const double* e, const double* other, double* inverse_weight,
                       double* scaled) {
  ErrorSizes out;
  if (wide)
    errors_avx2(n, before, after, atol, rtol, e, other, inverse_weight, scaled, out);
  else
    errors(n, before, after, atol, rtol, e, other, inverse_weight, scaled, out);
  return out;
}

ChangeSizes change_sizes(int n, const double* a, const double* b, const double* at, const double* atol,
                         const double* rtol) {
  ChangeSizes out;
  if (wide)
    changes_avx2(n, a, b, at, atol, rtol, out);
  else
    changes(n, a, b, at, atol, rtol, out);
  return out;
}

double largest_share(int n, const double* v, const double* at, const double* atol, const double* rtol) {
  double out = 0;
  if (wide)
    shares_avx2(n, v, at, atol, rtol, out);
  else
    shares(n, v, at, atol, rtol, out);
  return out;
}

bool all_finite(int n, const double* x) { return (wide ? zeros_avx2(n, x) : zeros(n, x)) == 0; }

}  // namespace pendula::integrate
