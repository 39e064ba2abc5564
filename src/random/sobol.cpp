#include "random/sobol.hpp"

#include <array>
#include <bit>
#include <vector>

#include "base/epsilon.hpp"
#include "random/philox.hpp"

namespace pendula::random {
namespace {

constexpr int digits = 32;  // the sequence repeats after 2³² points, and a sweep has at most 10⁷
using Directions = std::array<std::uint32_t, digits>;

const std::uint16_t joe_kuo[] = {
#include "random/joe_kuo.def"
};

std::vector<Directions> make_directions() {
  std::vector<Directions> all(most_sobol_dimensions);
  for (int k = 0; k < digits; ++k) all[0][k] = 1U << (31 - k);
  const std::uint16_t* row = joe_kuo;
  for (int j = 1; j < most_sobol_dimensions; ++j) {
    const std::uint32_t polynomial = *row++;
    const int s = std::bit_width(polynomial) - 1;
    Directions& v = all[j];
    for (int k = 0; k < s; ++k) v[k] = static_cast<std::uint32_t>(*row++) << (31 - k);
    for (int k = s; k < digits; ++k) {  // v_k = a₁ v_{k-1} ⊕ … ⊕ a_{s-1} v_{k-s+1} ⊕ v_{k-s} ⊕ v_{k-s} 2^{-s}
      v[k] = v[k - s] ^ (v[k - s] >> s);
      for (int i = 1; i < s; ++i)
        if ((polynomial >> (s - i)) & 1) v[k] ^= v[k - i];
    }
  }
  return all;
}

/// Owen's scrambling: the permutation of every digit depends on the digits before it.
std::uint32_t nested(std::uint32_t x, int dimension, std::uint64_t seed) {
  std::uint32_t result = 0;
  for (int k = 0; k < digits; ++k) {
    const std::uint64_t before = k == 0 ? 0 : x >> (digits - k);
    // Number of the node in the tree of prefixes: 2^k - 1 nodes are above level k.
    const std::uint64_t node = (1ULL << k) - 1 + before;
    const std::uint32_t flip =
        block_at({seed, Use::scrambling, node, static_cast<std::uint32_t>(dimension)})[0] & 1;
    result = (result << 1) | (((x >> (digits - 1 - k)) & 1) ^ flip);
  }
  return result;
}

int prime(int number) {
  static std::vector<int> primes = {2, 3};
  for (int candidate = primes.back() + 2; static_cast<int>(primes.size()) <= number; candidate += 2) {
    bool is_prime = true;
    for (int p : primes) {
      if (p * p > candidate) break;
      if (candidate % p == 0) is_prime = false;
    }
    if (is_prime) primes.push_back(candidate);
  }
  return primes[number];
}

}  // namespace

std::uint32_t sobol_digits(std::uint64_t index, int dimension) {
  static const std::vector<Directions> directions = make_directions();
  const Directions& v = directions[dimension];
  std::uint64_t gray = index ^ (index >> 1);
  std::uint32_t x = 0;
  for (; gray != 0; gray &= gray - 1) x ^= v[std::countr_zero(gray)];
  return x;
}

double sobol(std::uint64_t index, int dimension, Scramble scramble, std::uint64_t seed) {
  std::uint32_t x = sobol_digits(index, dimension);
  if (scramble == Scramble::none) return x * 0x1p-32;
  const auto series = static_cast<std::uint32_t>(dimension);
  if (scramble == Scramble::digital)
    x ^= block_at({seed, Use::scrambling, 1ULL << 40, series})[0];
  else
    x = nested(x, dimension, seed);
  const std::uint64_t tail = bits_at({seed, Use::scrambling, (1ULL << 41) + index, series}) >> 32;
  return to_unit((static_cast<std::uint64_t>(x) << 32) | tail);
}

double halton(std::uint64_t index, int dimension, Scramble scramble, std::uint64_t seed) {
  const auto b = static_cast<std::uint64_t>(prime(dimension));
  double value = 0, weight = 1;
  std::uint64_t rest = index;
  for (std::uint32_t place = 0; scramble == Scramble::none ? rest > 0 : weight > eps / 4; ++place) {
    std::uint64_t digit = rest % b;
    rest /= b;
    weight /= static_cast<double>(b);
    if (scramble != Scramble::none) {
      const Block r =
          block_at({seed, Use::scrambling, (1ULL << 42) + place, static_cast<std::uint32_t>(dimension)});
      digit = ((1 + r[0] % (b - 1)) * digit + r[1] % b) % b;
    }
    value += static_cast<double>(digit) * weight;
  }
  if (scramble == Scramble::none) return value;
  return value <= 0 ? eps / 4 : value >= 1 ? 1 - eps / 2 : value;
}

}  // namespace pendula::random
