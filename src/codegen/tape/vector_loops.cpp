#include "codegen/tape/vector_loops.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "base/four.hpp"

namespace pendula::codegen {
namespace {

/// a[0], a[stride], a[2·stride], a[3·stride]. (Gathers of eight with AVX-512 are a third slower here.)
template <std::size_t stride>
[[gnu::always_inline]] inline void gather(const double* a, Four& out) {
  if constexpr (stride == 0) {
    out = Four{*a, *a, *a, *a};
  } else if constexpr (stride == 1) {
    load(out, a);
  } else {  // the second part begins at a[3], so that nothing after a[6] is read
    Four first, second;
    load(first, a);
    load(second, a + 3);
    out = __builtin_shufflevector(first, second, 0, 2, 5, 7);
  }
}

template <std::size_t sa, std::size_t sb, class F>
[[gnu::always_inline]] inline void strided(std::size_t n, const double* a, const double* b,
                                           double* __restrict r, const F& f) {
  std::size_t k = 0;
  Four x{}, y{}, result;
  for (; k + 4 <= n; k += 4) {
    gather<sa>(a + k * sa, x);
    gather<sb>(b + k * sb, y);
    f(result, x, y);
    store(r + k, result);
  }
  for (; k < n; ++k) f(r[k], a[k * sa], b[k * sb]);
}

template <class F>
[[gnu::always_inline]] inline void loop(const VectorLoop& p, std::size_t n, const Places& at, const F& f) {
  double* __restrict r = at.r;
  const double *a = at.a, *b = at.b;
  const std::size_t sa = p.stride[0], sb = p.stride[1];
  switch (sa * 8 + sb) {
    case 8 + 1:
      return strided<1, 1>(n, a, b, r, f);
    case 8 + 0:
      return strided<1, 0>(n, a, b, r, f);
    case 0 + 1:
      return strided<0, 1>(n, a, b, r, f);
    case 16 + 0:
      return strided<2, 0>(n, a, b, r, f);
    case 0 + 2:
      return strided<0, 2>(n, a, b, r, f);
    case 16 + 1:
      return strided<2, 1>(n, a, b, r, f);
    case 8 + 2:
      return strided<1, 2>(n, a, b, r, f);
    case 16 + 2:
      return strided<2, 2>(n, a, b, r, f);
    default:
      for (std::size_t k = 0; k < n; ++k) f(r[k], a[k * sa], b[k * sb]);
  }
}

/// Operations that are calls, or have no vector form in C++.
template <class F>
[[gnu::always_inline]] inline void one_by_one(const VectorLoop& p, std::size_t n, const Places& at,
                                              const F& f) {
  double* __restrict r = at.r;
  const double* a = at.a;
  const std::size_t sa = p.stride[0];
  if (sa == 1) {
    for (std::size_t k = 0; k < n; ++k) r[k] = f(a[k]);
  } else {
    for (std::size_t k = 0; k < n; ++k) r[k] = f(a[k * sa]);
  }
}

[[gnu::always_inline]] inline void run_any(const VectorLoop& p, std::size_t n, const Places& at) {
  switch (p.op) {
    case Op::neg:
      return loop(p, n, at, [](auto& r, const auto& a, const auto&) { r = -a; });
    case Op::add:
      return loop(p, n, at, [](auto& r, const auto& a, const auto& b) { r = a + b; });
    case Op::sub:
      return loop(p, n, at, [](auto& r, const auto& a, const auto& b) { r = a - b; });
    case Op::mul:
      return loop(p, n, at, [](auto& r, const auto& a, const auto& b) { r = a * b; });
    case Op::div:
      return loop(p, n, at, [](auto& r, const auto& a, const auto& b) { r = a / b; });
    case Op::sqrt:
      return one_by_one(p, n, at, [](double a) { return std::sqrt(a); });
    case Op::exp:
      return one_by_one(p, n, at, [](double a) { return std::exp(a); });
    default:
      return;
  }
}

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("avx2")]] void run_avx2(const VectorLoop& p, std::size_t n, const Places& at) {
  run_any(p, n, at);
}
#endif
void run_plain(const VectorLoop& p, std::size_t n, const Places& at) { run_any(p, n, at); }

using Run = void (*)(const VectorLoop&, std::size_t, const Places&);

Run best() {
#if defined(__x86_64__) && defined(__GNUC__)
  if (__builtin_cpu_supports("avx2")) return run_avx2;
#endif
  return run_plain;
}

constexpr std::size_t worth_it = 8;  // members

/// Looks members up by their operands and records which are placed already.
class Members {
 public:
  explicit Members(std::span<const Pair> members) : members_(members), placed_(members.size(), 0) {
    where_.reserve(members.size());
    for (std::uint32_t i = 0; i < members.size(); ++i) where_.emplace(key(members[i]), i);
  }

  /// The number of consecutive members from i on with these strides.
  std::size_t length(std::uint32_t i, Slot sa, Slot sb) const {
    Pair at = members_[i];
    std::size_t count = 1;
    for (;; ++count) {
      at.a += sa;
      at.b += sb;
      const auto next = where_.find(key(at));
      if (next == where_.end() || placed_[next->second]) return count;
    }
  }
  void take(std::uint32_t i, std::size_t count, Slot sa, Slot sb, std::vector<std::uint32_t>& order) {
    Pair at = members_[i];
    for (; count > 0; --count, at.a += sa, at.b += sb) {
      const std::uint32_t next = where_.at(key(at));
      placed_[next] = 1;
      order.push_back(next);
    }
  }
  bool placed(std::uint32_t i) const { return placed_[i]; }
  /// Is i the member found by its operands? Of equal members it is the first.
  bool found(std::uint32_t i) const { return where_.at(key(members_[i])) == i; }

 private:
  static std::uint64_t key(Pair p) { return std::uint64_t{p.a} << 32 | p.b; }
  std::span<const Pair> members_;
  std::vector<char> placed_;
  std::unordered_map<std::uint64_t, std::uint32_t> where_;
};

}  // namespace

bool has_loop(Op op) {
  return op == Op::neg || op == Op::add || op == Op::sub || op == Op::mul || op == Op::div ||
         op == Op::sqrt || op == Op::exp;
}

void run_members(const VectorLoop& loop, std::size_t count, const Places& places) {
  static const Run run = best();
  run(loop, count, places);
}

std::vector<Copy> arrange_copies(std::span<const Slot> from, Slot inputs) {
  constexpr std::size_t furthest = 4;  // upper limit for a period of the model
  std::vector<Copy> result;
  std::vector<char> placed(from.size(), 0);
  const auto follows = [&](std::size_t k, std::size_t d, Slot stride) {
    return !placed[k] && from[k] - from[k - d] == stride && (from[k] < inputs) == (from[k - d] < inputs);
  };
  for (std::size_t k = 0; k < from.size(); ++k) {
    if (placed[k]) continue;
    std::size_t longest = 1, step = 1;
    for (std::size_t d = 1; d <= furthest && k + d < from.size(); ++d) {
      const Slot stride = from[k + d] - from[k];  // modulo 2³²: may be negative
      std::size_t length = 1, at = k + d;
      for (; at < from.size() && follows(at, d, stride); at += d) ++length;
      if (length > longest) {
        longest = length;
        step = d;
      }
    }
    const Slot stride = longest > 1 ? from[k + step] - from[k] : 1;
    result.push_back({from[k], static_cast<Slot>(k), static_cast<Slot>(longest),
                      static_cast<std::int32_t>(stride), static_cast<std::int32_t>(step)});
    for (std::size_t j = 0; j < longest; ++j) placed[k + j * step] = 1;
  }
  return result;
}

void run_copy(const Copy& c, const double* from, double* to) {
  constexpr Slot worth_a_call = 16;
  from += c.from;
  to += c.to;
  if (c.from_stride == 1 && c.to_stride == 1 && c.count >= worth_a_call) {
    std::copy_n(from, c.count, to);
  } else if (c.from_stride == 1 && c.to_stride == 2) {
    for (std::size_t k = 0; k < c.count; ++k) to[2 * k] = from[k];
  } else {
    for (std::ptrdiff_t k = 0; k < c.count; ++k) to[k * c.to_stride] = from[k * c.from_stride];
  }
}

Arrangement arrange(std::span<const Pair> members) {
  Arrangement result;
  std::vector<std::uint32_t> sorted(members.size());
  std::iota(sorted.begin(), sorted.end(), 0U);
  if (members.size() < worth_it) {
    result.order = std::move(sorted);
    return result;
  }
  std::stable_sort(sorted.begin(), sorted.end(), [&](std::uint32_t i, std::uint32_t j) {
    return std::pair(members[i].a, members[i].b) < std::pair(members[j].a, members[j].b);
  });
  constexpr Slot strides[][2] = {{1, 1}, {1, 0}, {0, 1}, {2, 1}, {1, 2}, {2, 2},
                                 {2, 0}, {0, 2}, {4, 1}, {1, 4}, {4, 2}, {2, 4}};
  Members left(members);
  for (std::uint32_t i : sorted) {
    if (left.placed(i) || !left.found(i)) continue;
    std::size_t longest = 0, best_score = 0;
    const Slot* best_stride = strides[0];
    for (const auto& stride : strides) {
      const std::size_t length = left.length(i, stride[0], stride[1]);
      // prefers small strides: a stretch of every other member may be longer by chance, skipping
      // members in between
      const std::size_t score = stride[0] <= 1 && stride[1] <= 1 ? 2 * length : length;
      if (score > best_score) {
        best_score = score;
        longest = length;
        best_stride = stride;
      }
    }
    if (longest < worth_it) continue;
    result.stretches.push_back({result.order.size(), longest, {best_stride[0], best_stride[1]}});
    left.take(i, longest, best_stride[0], best_stride[1], result.order);
  }
  for (std::uint32_t i : sorted)
    if (!left.placed(i)) result.order.push_back(i);
  return result;
}

}  // namespace pendula::codegen
