// Counter-based random numbers, a function of seed and position: Philox4x32-10.
//
// A counter-based generator has no state: block number c of the stream with key k is a bijection of c, so
// that any number can be computed alone, by any process, in any order. Source: Salmon, Moraes, Dror & Shaw,
// Parallel random numbers: as easy as 1, 2, 3, SC11, 2011.
#pragma once

#include <array>
#include <cstdint>

namespace pendula::random {

using Block = std::array<std::uint32_t, 4>;

/// The ten rounds of Philox4x32.
Block philox4x32(Block counter, std::array<std::uint32_t, 2> key);

/// Purpose of a random number: different uses of one seed share no numbers.
enum class Use : std::uint32_t { design = 1, permutation, scrambling, script, bootstrap, process, noise };

/// Number `number` of the series `series` under a seed. `use` keeps consumers apart.
struct Place {
  std::uint64_t seed = 0;
  Use use = Use::design;
  std::uint64_t number = 0;
  std::uint32_t series = 0;
};

Block block_at(const Place& place);
/// Uniform in the open interval (0, 1): (k + 1/2)/2⁵² with k of 52 random bits. Never 0, never 1.
double uniform_at(const Place& place);
/// 64 random bits.
std::uint64_t bits_at(const Place& place);
/// The middle of one of 2⁵² equal cells of (0, 1), from the upper 52 bits (the middle of the last
/// of 2⁵³ would be rounded to 1).
double to_unit(std::uint64_t bits);

/// A permutation of 0 … n - 1 as a function of its argument: Feistel network over the smallest power of four
/// that holds n, repeated until the result lies below n. Cost: at most about four passes on average.
/// requires  0 ≤ i < n ≤ 2⁶²
std::uint64_t permuted(std::uint64_t i, std::uint64_t n, std::uint64_t seed, std::uint32_t series);

}  // namespace pendula::random
