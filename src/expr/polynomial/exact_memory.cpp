#include "expr/polynomial/exact_memory.hpp"

#include <cstdlib>
#include <new>

#include <gmp.h>

namespace pendula {

void* exact_memory::allocate(std::size_t size) {
  if (void* memory = std::malloc(size ? size : 1)) return memory;
  throw std::bad_alloc();
}

void* exact_memory::reallocate(void* old, std::size_t, std::size_t size) {
  if (void* memory = std::realloc(old, size ? size : 1)) return memory;
  throw std::bad_alloc();
}

void throw_when_exact_memory_ends() {
  mp_set_memory_functions(exact_memory::allocate, exact_memory::reallocate,
                          [](void* memory, std::size_t) { std::free(memory); });
}

}  // namespace pendula
