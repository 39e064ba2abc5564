// The random points at which generic properties are decided, for the files of this folder.
#pragma once

#include <cstdint>

#include "expr/graph/declaration.hpp"

namespace pendula::generic {

/// Points tried until one lies in the domain of the expressions: if half of the points do, 16 fail once in
/// 65000 cases.
constexpr int attempts = 16;

/// splitmix64 of a seed and a name: the same symbol has the same value in every call with the same seed, and
/// in every session. Applications of one function to different arguments are told apart by their ids.
inline std::uint64_t random_bits(std::uint64_t seed, Expr e) {
  const std::uint64_t who = e.is_symbol() ? name_hash(e) : e.id();
  std::uint64_t h = seed * 0x9e3779b97f4a7c15ull + who + 0x632be59bd9b4e019ull;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
  return h ^ (h >> 31);
}

}  // namespace pendula::generic
