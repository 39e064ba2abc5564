// A cache that forgets the least recently used: the one cache type of the project.
//
// Keys are values with == and a hash; a key must contain everything that the answer depends on, because equal
// keys give the stored answer without a further check. Every entry has a size (1 if all cost the same), and
// the entries in the cache add up to at most `capacity`; the newest one is kept even if it is larger.
// Not synchronised: a cache that several threads use needs a mutex of its owner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/remembered.hpp"

namespace pendula {

/// FNV-1a over the entries of a key made of integers.
struct WordsHash {
  template <class Words>
  std::size_t operator()(const Words& key) const {
    std::size_t h = 1469598103934665603ULL;
    for (const auto word : key) h = (h ^ static_cast<std::uint32_t>(word)) * 1099511628211ULL;
    return h;
  }
};

/// How the finder of an answer comes to refer to the expressions in it: by their windows (Origins),
/// which are also those of the call that stored it; or because the finder touches them, if there
/// are others than those in the key.
enum class Refers { by_windows, by_touch };

template <class Key, class Value, class Hash = std::hash<Key>, Refers refers = Refers::by_windows>
class LruCache : public Remembered {
 public:
  explicit LruCache(std::size_t capacity) : capacity_(capacity) {}
  LruCache(const LruCache&) = delete;  // where_ points into entries_
  LruCache& operator=(const LruCache&) = delete;

  /// The stored value, now the most recently used, or nullptr. Valid until the next insert.
  Value* find(const Key& key) {
    const auto at = where_.find(key);
    if (at == where_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, at->second);
    if constexpr (refers == Refers::by_windows) Origins::add(at->second->origins);
    return &at->second->value;
  }

  /// Stores a value in the place of an earlier one of this key.
  Value& insert(const Key& key, Value value, std::size_t size = 1) {
    if (const auto old = where_.find(key); old != where_.end()) remove(old->second);
    entries_.push_front({key, std::move(value), size, Origins::so_far()});
    where_[key] = entries_.begin();
    total_ += size;
    while (total_ > capacity_ && entries_.size() > 1) remove(std::prev(entries_.end()));
    return entries_.front().value;
  }

  std::size_t size() const { return entries_.size(); }

  void clear() {
    where_.clear();
    entries_.clear();
    total_ = 0;
  }

 private:
  struct Entry {
    Key key;
    Value value;
    std::size_t size;
    Windows origins;  ///< of key and value
  };
  using Place = typename std::list<Entry>::iterator;

  void forget() override { clear(); }

  void remove(Place entry) {
    total_ -= entry->size;
    where_.erase(entry->key);
    entries_.erase(entry);
  }

  std::size_t capacity_, total_ = 0;
  std::list<Entry> entries_;  ///< most recently used first
  std::unordered_map<Key, Place, Hash> where_;
};

}  // namespace pendula
