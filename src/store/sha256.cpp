#include "store/sha256.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace pendula::store {
namespace {

using State = std::array<std::uint32_t, 8>;

/// The first 32 bits of the fractional part of √p (root = 2) or ∛p (root = 3) for the first n primes p.
template <std::size_t n>
std::array<std::uint32_t, n> fractions(int root) {
  std::array<std::uint32_t, n> result{};
  std::size_t count = 0;
  for (int candidate = 2; count < n; ++candidate) {
    bool is_prime = true;
    for (int d = 2; d * d <= candidate; ++d) is_prime &= candidate % d != 0;
    if (!is_prime) continue;
    const long double value = root == 2 ? std::sqrt(static_cast<long double>(candidate))
                                        : std::cbrt(static_cast<long double>(candidate));
    result[count++] = static_cast<std::uint32_t>((value - std::floor(value)) * 4294967296.0L);
  }
  return result;
}

void mix(State& state, const unsigned char* block) {
  static const auto K = fractions<64>(3);
  std::array<std::uint32_t, 64> w{};
  for (int i = 0; i < 16; ++i)
    w[i] = static_cast<std::uint32_t>(block[4 * i]) << 24 |
           static_cast<std::uint32_t>(block[4 * i + 1]) << 16 |
           static_cast<std::uint32_t>(block[4 * i + 2]) << 8 | block[4 * i + 3];
  for (int i = 16; i < 64; ++i) {
    const std::uint32_t s0 = std::rotr(w[i - 15], 7) ^ std::rotr(w[i - 15], 18) ^ (w[i - 15] >> 3);
    const std::uint32_t s1 = std::rotr(w[i - 2], 17) ^ std::rotr(w[i - 2], 19) ^ (w[i - 2] >> 10);
    w[i] = w[i - 16] + s0 + w[i - 7] + s1;
  }
  auto [a, b, c, d, e, f, g, h] = state;
  for (int i = 0; i < 64; ++i) {
    const std::uint32_t S1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t t1 = h + S1 + ((e & f) ^ (~e & g)) + K[i] + w[i];
    const std::uint32_t S0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t t2 = S0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g;
    g = f;
    f = e;
    e = d + t1;
    d = c;
    c = b;
    b = a;
    a = t1 + t2;
  }
  const State change = {a, b, c, d, e, f, g, h};
  for (int i = 0; i < 8; ++i) state[i] += change[i];
}

}  // namespace

std::string sha256(std::string_view bytes) {
  State state = fractions<8>(2);
  std::string padded(bytes);
  padded.push_back('\x80');
  while (padded.size() % 64 != 56) padded.push_back('\0');
  const std::uint64_t bits = 8 * static_cast<std::uint64_t>(bytes.size());
  for (int k = 7; k >= 0; --k) padded.push_back(static_cast<char>(bits >> (8 * k)));
  for (std::size_t at = 0; at < padded.size(); at += 64)
    mix(state, reinterpret_cast<const unsigned char*>(padded.data()) + at);
  std::string hex;
  for (std::uint32_t word : state)
    for (int k = 28; k >= 0; k -= 4) hex.push_back("0123456789abcdef"[(word >> k) & 15]);
  return hex;
}

}  // namespace pendula::store
