#include "expr/polynomial/exact_memory.hpp"

#include <array>
#include <cstdlib>
#include <new>
#include <utility>

#include <gmp.h>

namespace pendula {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr std::size_t largest_listed = 0;  // with sanitizers every use of freed memory must be detected
#else
constexpr std::size_t largest_listed = 64;  // bytes: numbers of eight limbs, 154 digits
#endif
constexpr std::size_t step = 8;    ///< a limb
constexpr int most_listed = 4096;  ///< of each size: 1.2 MB in all

/// Free lists of small blocks, by size. Nearly all rationals have one limb each in numerator and denominator
/// and live for one operation; malloc and free were 40 % of the time of simplify.
class FreeLists {
 public:
  static bool is_small(std::size_t size) { return size <= largest_listed && !ended; }

  /// A block of this size; null if there is none.
  void* take(std::size_t size) {
    List& list = lists_[number_of(size)];
    Piece* const piece = list.first;
    if (!piece) return nullptr;
    list.first = piece->next;
    --list.count;
    return piece;
  }
  /// Keeps a freed block; false if there are enough.
  bool keep(void* memory, std::size_t size) {
    List& list = lists_[number_of(size)];
    if (list.count >= most_listed) return false;
    list.first = new (memory) Piece{list.first};
    ++list.count;
    return true;
  }
  ~FreeLists() {
    ended = true;
    for (List& list : lists_)
      while (list.first) std::free(std::exchange(list.first, list.first->next));
  }

 private:
  struct Piece {
    Piece* next;
  };
  struct List {
    Piece* first = nullptr;
    int count = 0;
  };
  static std::size_t number_of(std::size_t size) { return (size + step - 1) / step; }
  std::array<List, largest_listed / step + 1> lists_;
  static thread_local bool ended;  ///< for numbers that outlive the lists of their thread
};

thread_local bool FreeLists::ended = false;
thread_local FreeLists free_lists;

/// The full size of a block, whatever smaller size was requested.
std::size_t whole(std::size_t size) {
  return size <= largest_listed ? (size + step - 1) / step * step : size;
}

void release(void* memory, std::size_t size) {
  if (!FreeLists::is_small(size) || !free_lists.keep(memory, size)) std::free(memory);
}

}  // namespace

void* exact_memory::allocate(std::size_t size) {
  if (FreeLists::is_small(size))
    if (void* memory = free_lists.take(size)) return memory;
  if (void* memory = std::malloc(size ? whole(size) : step)) return memory;
  throw std::bad_alloc();
}

void* exact_memory::reallocate(void* old, std::size_t, std::size_t size) {
  if (void* memory = std::realloc(old, size ? whole(size) : step)) return memory;
  throw std::bad_alloc();
}

void throw_when_exact_memory_ends() {
  mp_set_memory_functions(exact_memory::allocate, exact_memory::reallocate, release);
}

}  // namespace pendula
