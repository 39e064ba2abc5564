// LRU cache of compiled programs; the key is everything that a program depends on.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <unordered_map>
#include <vector>

namespace pendula::codegen {

using Key = std::vector<std::uint32_t>;
struct KeyHash {
  std::size_t operator()(const Key& key) const {
    std::size_t h = 1469598103934665603ULL;  // FNV-1a over words
    for (std::uint32_t id : key) h = (h ^ id) * 1099511628211ULL;
    return h;
  }
};

/// The most recently used, up to a total size.
template <class Value>
class Memory {
 public:
  std::shared_ptr<Value> find(const Key& key) {
    const auto at = where_.find(key);
    if (at == where_.end()) return nullptr;
    items_.splice(items_.begin(), items_, at->second);
    return at->second->value;
  }
  void add(const Key& key, std::shared_ptr<Value> value, std::size_t size) {
    constexpr std::size_t most = 1'000'000;  // instructions: some 60 MB
    constexpr std::size_t entry = 400;       // what else an entry holds, machine code on a page of its own
    if (const auto old = where_.find(key); old != where_.end()) {
      total_ -= old->second->size;
      items_.erase(old->second);
    }
    items_.push_front({key, std::move(value), entry + size + key.size()});
    where_[key] = items_.begin();
    total_ += items_.front().size;
    while (total_ > most && items_.size() > 1) {
      total_ -= items_.back().size;
      where_.erase(items_.back().key);
      items_.pop_back();
    }
  }

 private:
  struct Item {
    Key key;
    std::shared_ptr<Value> value;
    std::size_t size;
  };
  std::list<Item> items_;
  std::unordered_map<Key, typename std::list<Item>::iterator, KeyHash> where_;
  std::size_t total_ = 0;
};

}  // namespace pendula::codegen
