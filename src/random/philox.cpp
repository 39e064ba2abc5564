#include "random/philox.hpp"

namespace pendula::random {

Block philox4x32(Block c, std::array<std::uint32_t, 2> key) {
  constexpr std::uint64_t M0 = 0xD2511F53, M1 = 0xCD9E8D57;  // multipliers
  constexpr std::uint32_t W0 = 0x9E3779B9, W1 = 0xBB67AE85;  // Weyl increments: golden ratio, √3 - 1
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = M0 * c[0], p1 = M1 * c[2];
    c = {static_cast<std::uint32_t>(p1 >> 32) ^ c[1] ^ key[0], static_cast<std::uint32_t>(p1),
         static_cast<std::uint32_t>(p0 >> 32) ^ c[3] ^ key[1], static_cast<std::uint32_t>(p0)};
    key = {key[0] + W0, key[1] + W1};
  }
  return c;
}

Block block_at(const Place& p) {
  return philox4x32({static_cast<std::uint32_t>(p.number), static_cast<std::uint32_t>(p.number >> 32),
                     p.series, static_cast<std::uint32_t>(p.use)},
                    {static_cast<std::uint32_t>(p.seed), static_cast<std::uint32_t>(p.seed >> 32)});
}

std::uint64_t bits_at(const Place& place) {
  const Block b = block_at(place);
  return (static_cast<std::uint64_t>(b[1]) << 32) | b[0];
}

double to_unit(std::uint64_t bits) { return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52; }

double uniform_at(const Place& place) { return to_unit(bits_at(place)); }

std::uint64_t permuted(std::uint64_t i, std::uint64_t n, std::uint64_t seed, std::uint32_t series) {
  if (n < 2) return 0;
  int half = 1;  // number of bits of each half in the Feistel network
  while ((1ULL << (2 * half)) < n) ++half;
  const std::uint64_t mask = (1ULL << half) - 1;
  constexpr int rounds =
      8;  // four already give a strong permutation of random round functions (Luby & Rackoff)
  do {
    std::uint64_t left = i >> half, right = i & mask;
    for (std::uint32_t round = 0; round < rounds; ++round) {
      const Block b = philox4x32(
          {static_cast<std::uint32_t>(right), round, series, static_cast<std::uint32_t>(Use::permutation)},
          {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
      const std::uint64_t next = left ^ (b[0] & mask);
      left = right;
      right = next;
    }
    i = (left << half) | right;
  } while (i >= n);
  return i;
}

}  // namespace pendula::random
