#include "sysid/data/signals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numeric>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "sysid/data/excitation.hpp"

namespace pendula::sysid {
namespace {

constexpr double tau = 2 * M_PI;

void check_samples(long n) {
  if (n < 1) throw Error(text("the number of samples must be positive, got ", n));
  constexpr long most = 10'000'000;  // 80 MB
  if (n > most) throw Error(text(n, " samples are too many: at most 10⁷"));
}

void check_levels(double low, double high) {
  if (!std::isfinite(low) || !std::isfinite(high) || !(low < high))
    throw Error(text("low must be below high, got low = ", rounded(low), ", high = ", rounded(high)));
}

/// Exponents of primitive polynomials over GF(2), the order first: the taps of maximum-length registers.
constexpr std::array<std::array<int, 4>, 25> taps = {{{},
                                                      {},
                                                      {2, 1},
                                                      {3, 2},
                                                      {4, 3},
                                                      {5, 3},
                                                      {6, 5},
                                                      {7, 6},
                                                      {8, 6, 5, 4},
                                                      {9, 5},
                                                      {10, 7},
                                                      {11, 9},
                                                      {12, 6, 4, 1},
                                                      {13, 4, 3, 1},
                                                      {14, 5, 3, 1},
                                                      {15, 14},
                                                      {16, 15, 13, 4},
                                                      {17, 14},
                                                      {18, 11},
                                                      {19, 6, 2, 1},
                                                      {20, 17},
                                                      {21, 19},
                                                      {22, 21},
                                                      {23, 18},
                                                      {24, 23, 22, 17}}};

constexpr int most_order = static_cast<int>(taps.size()) - 1;  // period 2²⁴ - 1 > 10⁷ samples

/// Numbers in [0, 1): xorshift64* (Vigna, ACM Trans. Math. Softw. 42(4), 2016).
class Random {
 public:
  explicit Random(long seed) : state_(0x9E3779B97F4A7C15ull * static_cast<unsigned long>(seed + 1) | 1) {}
  double operator()() {
    state_ ^= state_ >> 12, state_ ^= state_ << 25, state_ ^= state_ >> 27;
    return static_cast<double>((state_ * 0x2545F4914F6CDD1Dull) >> 11) / 9007199254740992.0;
  }

 private:
  std::uint64_t state_;
};

/// cos(2πx), exact at multiples of a quarter turn.
double cos_turns(double x) {
  x -= std::floor(x);
  if (x == 0.25 || x == 0.75) return 0;
  return std::cos(tau * x);
}

using Complexes = std::vector<std::complex<double>>;

/// In place, radix 2; the size is a power of 2.
void fft(Complexes& x, bool inverse) {
  const std::size_t n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(x[i], x[j]);
  }
  Complexes root(n / 2);
  for (std::size_t k = 0; k < n / 2; ++k)
    root[k] = std::polar(1.0, (inverse ? tau : -tau) * static_cast<double>(k) / static_cast<double>(n));
  for (std::size_t size = 2; size <= n; size *= 2) {
    poll_interrupt();
    for (std::size_t i = 0; i < n; i += size)
      for (std::size_t k = 0; k < size / 2; ++k) {
        const auto a = x[i + k], b = x[i + k + size / 2] * root[k * (n / size)];
        x[i + k] = a + b;
        x[i + k + size / 2] = a - b;
      }
  }
}

/// The transform for any size, by a convolution with e^{iπk²/N} (Bluestein, IEEE Trans. Audio
/// Electroacoust. 18(4), 1970).
Complexes transform(const Vec& u) {
  const auto n = static_cast<std::size_t>(u.size());
  std::size_t size = 1;
  while (size < 2 * n) size *= 2;
  if ((n & (n - 1)) == 0) {
    Complexes x(u.data(), u.data() + n);
    fft(x, false);
    return x;
  }
  Complexes chirp_factor(n), a(size), b(size);
  for (std::size_t k = 0; k < n; ++k)  // reduces k² modulo 2N to keep the angle small
    chirp_factor[k] =
        std::polar(1.0, M_PI * static_cast<double>(static_cast<std::uint64_t>(k) * k % (2 * n)) /
                            static_cast<double>(n));
  for (std::size_t k = 0; k < n; ++k) {
    a[k] = u[k] * std::conj(chirp_factor[k]);
    b[k] = chirp_factor[k];
    if (k > 0) b[size - k] = chirp_factor[k];
  }
  fft(a, false);
  fft(b, false);
  for (std::size_t k = 0; k < size; ++k) a[k] *= b[k];
  fft(a, true);
  Complexes x(n);
  for (std::size_t k = 0; k < n; ++k) x[k] = a[k] * std::conj(chirp_factor[k]) / static_cast<double>(size);
  return x;
}

/// The order that prbs() takes.
int prbs_order(long samples, const Prbs& o) {
  if (o.order) return *o.order;
  int order = 2;
  while (order < most_order && ((1L << order) - 1) * o.hold < samples) ++order;
  return order;
}

}  // namespace

Vec prbs(long samples, const Prbs& o) {
  check_samples(samples);
  check_levels(o.low, o.high);
  if (o.order && (*o.order < 2 || *o.order > most_order))
    throw Error(text("the order of the register must lie between 2 and ", most_order, ", got ", *o.order));
  if (o.hold < 1) throw Error(text("hold must be at least 1 sample, got ", o.hold));
  const int order = prbs_order(samples, o);
  const std::uint32_t mask = (1u << order) - 1;
  std::uint32_t state = static_cast<std::uint32_t>(o.seed) & mask;
  if (state == 0)
    throw Error(text("the seed ", o.seed, " leaves the register empty: it must not be 0 modulo 2^", order));
  Vec u(samples);
  for (long k = 0; k < samples; ++k) {
    if (k > 0 && k % o.hold == 0) {
      std::uint32_t bit = 0;
      for (int tap : taps[order])
        if (tap) bit ^= state >> (tap - 1);
      state = ((state << 1) | (bit & 1)) & mask;
    }
    u[k] = (state >> (order - 1)) & 1 ? o.high : o.low;
  }
  return u;
}

Vec multisine(long samples, const Multisine& o) {
  check_samples(samples);
  std::vector<long> lines = o.lines;
  if (lines.empty()) {
    if (samples < 4) throw Error("a multisine needs at least 4 samples");
    lines.resize(static_cast<std::size_t>(samples / 4));
    std::iota(lines.begin(), lines.end(), 1L);
  }
  for (long k : lines)
    if (k < 1 || 2 * k > samples)
      throw Error(
          text("the line ", k, " does not exist: with ", samples, " samples lines are 1 … ", samples / 2));
  std::vector<double> a = o.amplitudes;
  if (a.empty()) a.assign(lines.size(), 1);
  if (a.size() != lines.size())
    throw Error(text("there are ", a.size(), " amplitudes for ", lines.size(), " lines"));
  if (o.phases != "schroeder" && o.phases != "zero" && o.phases != "random")
    throw Error(text("phases must be \"schroeder\", \"zero\" or \"random\", got '", o.phases, "'"));
  if (!(o.peak >= 0) || !std::isfinite(o.peak))
    throw Error("peak must be a number ≥ 0 (0: amplitudes as they are)");
  constexpr double most_cosines = 4e9;  // 45 s at the measured 11 ns each
  if (static_cast<double>(samples) * static_cast<double>(lines.size()) > most_cosines)
    throw Error(
        text(lines.size(), " lines of ", samples, " samples are too many: their product is at most 4·10⁹"));
  Random random(o.seed);
  Vec u = Vec::Zero(samples);
  const auto K = static_cast<double>(lines.size());
  for (std::size_t j = 0; j < lines.size(); ++j) {
    poll_interrupt();
    const double number = static_cast<double>(j + 1);
    const double phase = o.phases == "schroeder" ? -M_PI * number * (number - 1) / K
                         : o.phases == "random"  ? tau * random()
                                                 : 0;
    for (long t = 0; t < samples; ++t)  // reduces k t modulo N to keep the angle small
      u[t] +=
          a[j] *
          std::cos(tau * static_cast<double>(lines[j] * t % samples) / static_cast<double>(samples) + phase);
  }
  const double largest = u.cwiseAbs().maxCoeff();
  constexpr double cancelled = 1e-14;  // 45 ε: what rounding leaves of sums of cosines that are 0
  for (double& v : u)
    if (std::fabs(v) < cancelled * largest) v = 0;
  if (o.peak > 0 && largest > 0) u *= o.peak / largest;
  return u;
}

Vec chirp(long samples, const Chirp& o) {
  check_samples(samples);
  if (!(o.Ts > 0) || !std::isfinite(o.Ts)) throw Error("the sampling time Ts must be positive");
  const double nyquist = 0.5 / o.Ts;
  constexpr double rounding = 1e-12;  // of quotients such as 1/(2*Ts): 4500 ε
  for (double f : {o.from, o.to})
    if (!(f >= 0) || f > nyquist * (1 + rounding))
      throw Error(
          text("frequencies must lie between 0 and 1/(2 Ts) = ", rounded(nyquist), " Hz, got ", rounded(f)));
  if (o.exponential && !(o.from > 0 && o.to > 0))
    throw Error("an exponential chirp needs positive frequencies");
  const double T = static_cast<double>(samples) * o.Ts;
  Vec u(samples);
  for (long k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * o.Ts;
    double turns = o.from * t + (o.to - o.from) * t * t / (2 * T);
    if (o.exponential && o.from != o.to) {
      const double rate = std::log(o.to / o.from) / T;
      turns = o.from * std::expm1(rate * t) / rate;
    }
    u[k] = o.amplitude * cos_turns(turns);
  }
  return u;
}

namespace {

template <class Shape>
Vec periodic(long samples, const Periodic& o, const Shape& shape) {
  check_samples(samples);
  check_levels(o.low, o.high);
  if (!(o.period >= 2)) throw Error(text("the period must be at least 2 samples, got ", rounded(o.period)));
  if (!(o.duty > 0 && o.duty <= 1)) throw Error(text("duty must lie between 0 and 1, got ", rounded(o.duty)));
  Vec u(samples);
  for (long k = 0; k < samples; ++k) {
    const double part = std::fmod(static_cast<double>(k), o.period) / o.period;
    u[k] = o.low + (o.high - o.low) * shape(part);
  }
  return u;
}

}  // namespace

Vec square(long samples, const Periodic& o) {
  return periodic(samples, o, [&](double part) { return part < o.duty ? 1.0 : 0.0; });
}

Vec sawtooth(long samples, const Periodic& o) {
  return periodic(samples, o,
                  [&](double part) { return part < o.duty ? part / o.duty : (1 - part) / (1 - o.duty); });
}

double crest_factor(const Vec& u) {
  const double rms = std::sqrt(u.squaredNorm() / static_cast<double>(u.size()));
  if (!(rms > 0)) throw Error("the signal is zero: it has no crest factor");
  return u.cwiseAbs().maxCoeff() / rms;
}

Spectrum periodogram(const Vec& u, double Ts) {
  check_samples(u.size());
  if (!(Ts > 0) || !std::isfinite(Ts)) throw Error("the sampling time Ts must be positive");
  for (Index k = 0; k < u.size(); ++k)
    if (!std::isfinite(u[k]))
      throw Error(text("sample ", k + 1, " is not a finite number; fill gaps with d:fill()"));
  const Complexes x = transform(u);
  const Index half = u.size() / 2;
  Spectrum s{Vec(half + 1), Vec(half + 1), u.squaredNorm() / static_cast<double>(u.size()), Ts, u.size()};
  for (Index k = 0; k <= half; ++k) {
    s.f[k] = static_cast<double>(k) / (static_cast<double>(u.size()) * Ts);
    s.power[k] = std::norm(x[k]) / static_cast<double>(u.size());
  }
  return s;
}

std::string describe(const Spectrum& s) {
  Index at = 0;
  const double top = s.power.maxCoeff(&at);
  constexpr double visible = 1e-10;  // of the largest, as the text says; rounding leaves ε² = 5e-32
  const Index lines = (s.power.array() > visible * top).count();
  std::string out = text("periodogram: ", s.samples, " samples, Ts = ", rounded(s.Ts, 6), ", ", s.f.size(),
                         " frequencies up to ", rounded(s.f[s.f.size() - 1], 6), " Hz\n  mean square ",
                         rounded(s.mean_square, 6));
  if (!(top > 0)) return out;
  return out + text(", ", lines, lines == 1 ? " line" : " lines", " above 10⁻¹⁰ of the largest, which is at ",
                    rounded(s.f[at], 6), " Hz");
}

int excitation_order(const Vec& u, int limit) {
  // the factorisation for 1000 columns costs 2·10⁶ operations per sample
  if (limit < 1 || limit > 1000) throw Error(text("limit must lie between 1 and 1000, got ", limit));
  IdData d;
  d.u = u;
  d.y = Mat::Zero(u.size(), 1);
  d.starts = {0};
  return excitation_order(d, 0, limit);
}

}  // namespace pendula::sysid
