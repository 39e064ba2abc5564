#include <doctest/doctest.h>

#include <memory>
#include <string>

#include "base/lru_cache.hpp"

namespace pendula::lru_cache_test {

using pendula::LruCache;

TEST_CASE("lru cache: the least recently used entry goes first") {
  LruCache<int, std::string> cache(2);
  cache.insert(1, "one");
  cache.insert(2, "two");
  CHECK(*cache.find(1) == "one");  // 2 is now the oldest
  cache.insert(3, "three");
  CHECK(cache.find(2) == nullptr);
  CHECK(*cache.find(1) == "one");
  CHECK(*cache.find(3) == "three");
}

TEST_CASE("lru cache: a value in the place of an earlier one of its key") {
  LruCache<int, int> cache(3);
  cache.insert(1, 10, 2);
  cache.insert(1, 11, 1);
  cache.insert(2, 20, 2);  // fits only if the first size was given back
  CHECK(*cache.find(1) == 11);
  CHECK(*cache.find(2) == 20);
  CHECK(cache.size() == 2);
}

TEST_CASE("lru cache: sizes add up to the capacity, and the newest entry stays") {
  LruCache<std::vector<int>, std::unique_ptr<int>, pendula::WordsHash> cache(10);
  cache.insert({1}, std::make_unique<int>(1), 4);
  cache.insert({2}, std::make_unique<int>(2), 4);
  cache.insert({3}, std::make_unique<int>(3), 100);
  CHECK(cache.size() == 1);
  CHECK(**cache.find({3}) == 3);
}

}  // namespace pendula::lru_cache_test
