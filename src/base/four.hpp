#pragma once
// Four neighbouring doubles as one SIMD value, for loops that compilers leave scalar. Memory is read and written through
// load() and store() only, which accept any address; the value itself is aligned as the compiler likes.

namespace pendula {

using Four = double __attribute__((vector_size(32)));

namespace detail {
struct [[gnu::packed, gnu::may_alias]] FourInMemory {
  Four value;
};
}  // namespace detail

[[gnu::always_inline]] inline void load(Four& to, const double* from) {
  to = reinterpret_cast<const detail::FourInMemory*>(from)->value;
}

[[gnu::always_inline]] inline void store(double* to, const Four& from) {
  reinterpret_cast<detail::FourInMemory*>(to)->value = from;
}

}  // namespace pendula
