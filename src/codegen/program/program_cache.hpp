// Compiled programs by everything that they depend on. They refer to the expressions in their keys.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/lru_cache.hpp"

namespace pendula::codegen {

using Key = std::vector<std::uint32_t>;

/// The most recently used, up to a total size in instructions.
template <class Value>
class ProgramCache {
 public:
  std::shared_ptr<Value> find(const Key& key) {
    const auto* found = known_.find(key);
    return found ? *found : nullptr;
  }
  void add(const Key& key, std::shared_ptr<Value> value, std::size_t instructions) {
    constexpr std::size_t entry = 400;  // what else an entry holds, machine code on a page of its own
    known_.insert(key, std::move(value), entry + instructions + key.size());
  }

 private:
  static constexpr std::size_t most = 1'000'000;  // instructions: some 60 MB
  LruCache<Key, std::shared_ptr<Value>, WordsHash, Refers::by_touch> known_{most};
};

}  // namespace pendula::codegen
