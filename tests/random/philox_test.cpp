// The generator against the vectors published with it, and what is built on it.
#include "random/philox.hpp"

#include <doctest/doctest.h>

#include <set>
#include <vector>

namespace pendula::philox_test {

using namespace pendula::random;

TEST_CASE("Philox4x32-10: the known answers of its authors") {
  CHECK(philox4x32({0, 0, 0, 0}, {0, 0}) == Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
  CHECK(philox4x32({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}) ==
        Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
  CHECK(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
        Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST_CASE("unit numbers are never 0 and never 1, and the middle of their cells") {
  CHECK(to_unit(0) == 0x1p-53);
  CHECK(to_unit(~0ULL) < 1);
  CHECK(1 - to_unit(~0ULL) == 0x1p-53);
  CHECK(to_unit(1ULL << 63) == doctest::Approx(0.5));
}

TEST_CASE("different uses, seeds, series and numbers give different numbers") {
  std::set<std::uint64_t> seen;
  for (std::uint64_t seed : {0ULL, 1ULL, 1ULL << 32})
    for (Use use : {Use::design, Use::script})
      for (std::uint64_t number : {0ULL, 1ULL, 1ULL << 32})
        for (std::uint32_t series : {0U, 1U}) seen.insert(bits_at({seed, use, number, series}));
  CHECK(seen.size() == 3 * 2 * 3 * 2);
}

TEST_CASE("permutations hit every number once, whatever their length") {
  for (std::uint64_t n : {1ULL, 2ULL, 3ULL, 7ULL, 64ULL, 65ULL, 1000ULL}) {
    std::vector<int> hits(n);
    for (std::uint64_t i = 0; i < n; ++i) ++hits[permuted(i, n, 5, 2)];
    for (std::uint64_t i = 0; i < n; ++i) CHECK_MESSAGE(hits[i] == 1, "n = " << n << ", " << i);
  }
  bool other = false;
  for (std::uint64_t i = 0; i < 100; ++i) other |= permuted(i, 100, 5, 2) != permuted(i, 100, 6, 2);
  CHECK(other);
}

}  // namespace pendula::philox_test
