// The hash of one word.
#pragma once

#include <cstdint>

namespace pendula {

/// Every bit of h changes about half of the bits: the finaliser of splitmix64 (Steele, Lea & Flood, Fast
/// Splittable Pseudorandom Number Generators, OOPSLA 2014).
inline std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
  return h ^ (h >> 31);
}

}  // namespace pendula
