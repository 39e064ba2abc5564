#pragma once
// Two, four or eight neighbouring doubles as one SIMD value, for loops that compilers leave scalar. Memory
// is read and written through load() and store() only, which accept any address; the value itself is
// aligned as the compiler likes.

namespace pendula {

using Two = double __attribute__((vector_size(16)));
using Four = double __attribute__((vector_size(32)));
using Eight = double __attribute__((vector_size(64)));

namespace detail {
template <class Vector>
struct [[gnu::packed, gnu::may_alias]] InMemory {
  Vector value;
};
}  // namespace detail

template <class Vector>
[[gnu::always_inline]] inline void load(Vector& to, const double* from) {
  to = reinterpret_cast<const detail::InMemory<Vector>*>(from)->value;
}

template <class Vector>
[[gnu::always_inline]] inline void store(double* to, const Vector& from) {
  reinterpret_cast<detail::InMemory<Vector>*>(to)->value = from;
}

}  // namespace pendula
