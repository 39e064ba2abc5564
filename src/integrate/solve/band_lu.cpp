#include "integrate/solve/band_lu.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "base/epsilon.hpp"
#include "base/four.hpp"

namespace pendula::integrate {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

constexpr int padded(int count) { return (count + 3) / 4 * 4; }

/// The storage of the elimination; row k begins at a[k · parts · width].
struct Band {
  int n, below, width;
  double *a, *multiplier, *inverse, *scale;
  int *swap, *last;
  double weakest = 1;
  bool odd = false;
  int reach = 0;  ///< of the rows of U

  template <int parts>
  double* row(int k) const {
    return a + static_cast<std::ptrdiff_t>(k) * parts * width;
  }
};

template <int parts>
[[gnu::always_inline]] inline double size(const Band& b, int row, int slot) {
  const double* a = b.row<parts>(row) + slot;
  return parts == 1 ? std::fabs(*a) : std::fabs(*a) + std::fabs(a[b.width]);
}

/// The pivot of step k, with rows implicitly scaled to largest entries of 1: the diagonal unless another
/// entry is larger by a tenth. (Laplacians, with nearly equal entries, keep their band.) A smaller threshold
/// would admit multipliers well above 1; components that decay along the band would then cancel to rounding
/// instead of zero, and no part of a large model would ever be at rest (active_subsystem.hpp).
template <int parts>
[[gnu::always_inline]] inline int pivot(const Band& b, int k, double& largest) {
  constexpr double threshold = 0.9;
  const double here = size<parts>(b, k, b.below) * b.scale[k];
  int best = k;
  largest = here;
  for (int d = 1; d <= b.below && k + d < b.n; ++d) {
    const double other = size<parts>(b, k + d, b.below - d) * b.scale[k + d];
    if (other > largest) {
      largest = other;
      best = k + d;
    }
  }
  if (here < threshold * largest) return best;
  largest = here;
  return k;
}

template <int parts>
void exchange(Band& b, int k, int p) {
  const int count = std::max(b.last[k], b.last[p]) - k + 1;
  for (int part = 0; part < parts; ++part) {
    double* upper = b.row<parts>(k) + part * b.width + b.below;
    std::swap_ranges(upper, upper + count, b.row<parts>(p) + part * b.width + b.below - (p - k));
  }
  std::swap(b.last[k], b.last[p]);
  std::swap(b.scale[k], b.scale[p]);
  b.odd = !b.odd;
}

/// to -= f · from, `count` numbers, a multiple of four.
[[gnu::always_inline]] inline void subtract(double* to, double f, const double* from, int count) {
  for (int j = 0; j < count; j += 4) {
    Four a, b;
    load(a, to + j);
    load(b, from + j);
    store(to + j, a - f * b);
  }
}
[[gnu::always_inline]] inline void subtract(double* to, double re, double im, const double* from, int width,
                                            int count) {
  for (int j = 0; j < count; j += 4) {
    Four a, c, real, imaginary;
    load(a, from + j);
    load(c, from + width + j);
    load(real, to + j);
    load(imaginary, to + width + j);
    store(to + j, real - (re * a - im * c));
    store(to + width + j, imaginary - (re * c + im * a));
  }
}

template <int parts>
[[gnu::always_inline]] inline bool eliminate(Band& b) {
  for (int k = 0; k < b.n; ++k) {
    double largest = 0;
    const int p = b.swap[k] = pivot<parts>(b, k, largest);
    if (!(largest > b.n * eps * eps)) return false;
    b.weakest = std::min(b.weakest, largest);
    if (p != k) exchange<parts>(b, k, p);
    const double* from = b.row<parts>(k) + b.below;
    const int count = padded(b.last[k] - k);
    double re = 0, im = 0;
    if constexpr (parts == 1) {
      re = 1 / *from;
    } else {
      const double square = *from * *from + from[b.width] * from[b.width];
      re = *from / square;
      im = -from[b.width] / square;
      b.inverse[2 * k + 1] = im;
    }
    b.inverse[parts * k] = re;
    double* l = b.multiplier + static_cast<std::ptrdiff_t>(k) * parts * b.below;
    for (int d = 1; d <= b.below && k + d < b.n; ++d) {
      double* to = b.row<parts>(k + d) + b.below - d;
      if constexpr (parts == 1) {
        const double f = l[d - 1] = *to * re;
        if (f == 0) continue;
        subtract(to + 1, f, from + 1, count);
      } else {
        const double f = l[d - 1] = *to * re - to[b.width] * im;
        const double g = l[b.below + d - 1] = *to * im + to[b.width] * re;
        if (f == 0 && g == 0) continue;
        subtract(to + 1, f, g, from + 1, b.width, count);
      }
      b.last[k + d] = std::max(b.last[k + d], b.last[k]);
    }
    b.reach = std::max(b.reach, b.last[k] - k);
    // divided by the pivot, which shortens the dependency chain of solutions by a product
    double* u = b.row<parts>(k) + b.below;
    for (int j = 1; j <= count; ++j) {
      if constexpr (parts == 1) {
        u[j] *= re;
      } else {
        const double v = u[j];
        u[j] = v * re - u[b.width + j] * im;
        u[b.width + j] = v * im + u[b.width + j] * re;
      }
    }
  }
  return true;
}

bool eliminate_plain(Band& b, bool complex) { return complex ? eliminate<2>(b) : eliminate<1>(b); }
#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("avx2")]] bool eliminate_avx2(Band& b, bool complex) {
  return complex ? eliminate<2>(b) : eliminate<1>(b);
}
const bool band_by_avx2 = __builtin_cpu_supports("avx2");
#else
constexpr bool band_by_avx2 = false;
bool eliminate_avx2(Band& b, bool complex) { return eliminate_plain(b, complex); }
#endif

int parity(const std::vector<int>& order) {
  std::vector<char> seen(order.size(), 0);
  int sign = 1;
  for (int i = 0; i < static_cast<int>(order.size()); ++i)
    for (int k = i, length = 0; !seen[at(k)]; k = order[at(k)], ++length) {
      seen[at(k)] = 1;
      if (length > 0) sign = -sign;
    }
  return sign;
}

}  // namespace

template <class Scalar>
BandLU<Scalar>::BandLU(const std::vector<Position>& positions, std::shared_ptr<const BandOrder> order)
    : order_(std::move(order)),
      n_(static_cast<int>(order_->row.size())),
      width_(order_->below + 1 + padded(order_->below + order_->above)) {
  std::vector<int> row(at(n_)), column(at(n_));
  for (int k = 0; k < n_; ++k) row[at(order_->row[at(k)])] = column[at(order_->column[at(k)])] = k;
  for (const Position& p : positions) {
    const int i = row[at(p.row)], j = column[at(p.column)];
    target_.push_back(at(i) * parts * at(width_) + at(order_->below + j - i));
  }
  rows_.assign(at(n_) * parts * at(width_), 0);
  multipliers_.assign(at(n_) * parts * at(order_->below), 0);
  inverse_.assign(at(n_) * parts, 0);
  scale_.assign(at(n_), 0);
  y_.assign((at(n_) + at(width_)) * parts, 0);
  swap_.assign(at(n_), 0);
  last_.assign(at(n_), 0);
  parity_ = parity(order_->row) * parity(order_->column);
}

template <class Scalar>
bool BandLU<Scalar>::factorise(const Scalar* values) {
  const auto* numbers = reinterpret_cast<const double*>(values);
  std::fill(rows_.begin(), rows_.end(), 0.0);
  double check = 0;  // 0 · inf and 0 · NaN are NaN
  for (std::size_t k = 0; k < target_.size(); ++k) {
    for (std::size_t part = 0; part < parts; ++part) {
      const double v = numbers[k * parts + part];
      rows_[target_[k] + part * at(width_)] += v;
      check += v * 0;
    }
  }
  if (check != 0 || std::isnan(check)) return false;
  Band b{
      n_,           order_->below, width_, rows_.data(), multipliers_.data(), inverse_.data(), scale_.data(),
      swap_.data(), last_.data(),  1,      false};
  for (int k = 0; k < n_; ++k) {
    double largest = 0;
    for (int slot = 0; slot <= order_->below + order_->above; ++slot)
      largest = std::max(largest, size<static_cast<int>(parts)>(b, k, slot));
    if (!(largest > 0)) return false;
    scale_[at(k)] = 1 / largest;
    last_[at(k)] = std::min(k + order_->above, n_ - 1);
  }
  const bool regular = band_by_avx2 ? eliminate_avx2(b, parts == 2) : eliminate_plain(b, parts == 2);
  weakest_ = regular ? b.weakest : 0;
  odd_ = b.odd;
  reach_ = b.reach;
  return regular;
}

/// Calls f with a compile-time constant for small counts.
template <class F>
static void with_count(int count, F f) {
  switch (count) {
    case 1:
      return f(std::integral_constant<int, 1>());
    case 2:
      return f(std::integral_constant<int, 2>());
    case 3:
      return f(std::integral_constant<int, 3>());
    case 4:
      return f(std::integral_constant<int, 4>());
    case 5:
      return f(std::integral_constant<int, 5>());
    case 6:
      return f(std::integral_constant<int, 6>());
    case 7:
      return f(std::integral_constant<int, 7>());
    case 8:
      return f(std::integral_constant<int, 8>());
    default:
      return f(count);
  }
}

// The last unknown is followed by as many zeros as a row is long, so that no step has to check for the end.

template <>
void BandLU<double>::solve(double* b) {
  double* y = y_.data();
  std::fill(y_.begin() + n_, y_.end(), 0.0);
  for (int k = 0; k < n_; ++k) y[k] = b[order_->row[at(k)]];
  with_count(order_->below, [&](auto below) {
    const double* l = multipliers_.data();
    for (int k = 0; k < n_; ++k, l += below) {
      if (swap_[at(k)] != k) std::swap(y[k], y[swap_[at(k)]]);
      const double here = y[k];
      for (int d = 1; d <= below; ++d) y[k + d] -= l[d - 1] * here;
    }
  });
  for (int k = 0; k < n_; ++k) y[k] *= inverse_[at(k)];
  with_count(reach_, [&](auto reach) {
    for (int k = n_ - 1; k >= 0; --k) {
      const double* u = rows_.data() + static_cast<std::ptrdiff_t>(k) * width_ + order_->below;
      double sum = y[k];
      for (int j = reach; j > 0; --j) sum -= u[j] * y[k + j];  // the most recent value last
      y[k] = sum;
    }
  });
  for (int k = 0; k < n_; ++k) b[order_->column[at(k)]] = y[k];
}

template <>
void BandLU<std::complex<double>>::solve(std::complex<double>* b) {
  double *y = y_.data(), *z = y + y_.size() / 2;  // real and imaginary parts
  std::fill(y + n_, z, 0.0);
  std::fill(z + n_, y + y_.size(), 0.0);
  for (int k = 0; k < n_; ++k) {
    const std::complex<double> v = b[order_->row[at(k)]];
    y[k] = v.real();
    z[k] = v.imag();
  }
  with_count(order_->below, [&](auto below) {
    const double* l = multipliers_.data();
    for (int k = 0; k < n_; ++k, l += 2 * below) {
      if (const int p = swap_[at(k)]; p != k) {
        std::swap(y[k], y[p]);
        std::swap(z[k], z[p]);
      }
      const double re = y[k], im = z[k];
      for (int d = 1; d <= below; ++d) {
        const double f = l[d - 1], g = l[below + d - 1];
        y[k + d] -= f * re - g * im;
        z[k + d] -= f * im + g * re;
      }
    }
  });
  for (int k = 0; k < n_; ++k) {
    const double re = y[k], im = z[k], f = inverse_[2 * at(k)], g = inverse_[2 * at(k) + 1];
    y[k] = re * f - im * g;
    z[k] = re * g + im * f;
  }
  with_count(reach_, [&](auto reach) {
    for (int k = n_ - 1; k >= 0; --k) {
      const double* u = rows_.data() + static_cast<std::ptrdiff_t>(k) * 2 * width_ + order_->below;
      const double* v = u + width_;
      double re = y[k], im = z[k];
      for (int j = reach; j > 0; --j) {
        re -= u[j] * y[k + j] - v[j] * z[k + j];
        im -= u[j] * z[k + j] + v[j] * y[k + j];
      }
      y[k] = re;
      z[k] = im;
    }
  });
  for (int k = 0; k < n_; ++k) b[order_->column[at(k)]] = {y[k], z[k]};
}

template <class Scalar>
int BandLU<Scalar>::determinant(double& log) const {
  log = 0;
  if (parts == 2) return 0;
  int sign = odd_ ? -parity_ : parity_;
  for (double inverse : inverse_) {
    if (inverse < 0) sign = -sign;
    log -= std::log(std::fabs(inverse));
  }
  return sign;
}

template class BandLU<double>;
template class BandLU<std::complex<double>>;

}  // namespace pendula::integrate
