// Memory of exact numbers: where it ends, an exception instead of abort().
#pragma once

#include <cstddef>

namespace pendula {

/// GMP aborts where malloc fails; from here on it throws std::bad_alloc, which passes through its C functions
/// (what they had allocated is lost). To be called before the first session.
void throw_when_exact_memory_ends();

/// malloc and realloc that throw std::bad_alloc. `old_size` is not used: GMP passes it.
namespace exact_memory {
void* allocate(std::size_t size);
void* reallocate(void* old, std::size_t old_size, std::size_t size);
}  // namespace exact_memory

}  // namespace pendula
