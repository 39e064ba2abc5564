// The stack under recursions whose depth the user decides: nested expressions,
// functions that call each other.
//
// Instead of running into its end, which kills the program, such a recursion asks at every level whether
// there is room left: check_stack() throws an error that names a remedy, and the session goes on. Passes over
// a whole graph do not need it, as they are loops over `topological`. The stack of the first thread may grow
// to 64 MB; what does not ask and comes to its end all the same meets catch_exhausted_stack() of the shell,
// which ends the program with a message.
#pragma once

#include <cstdint>

namespace pendula {

/// Lets the stack of the main thread grow to 64 MB where the limits of the system allow it; memory is used
/// only as it is touched. For the beginning of a program.
void raise_stack_limit() noexcept;

/// Below this address a recursion ends; of each thread. The highest address of all: it is not yet known.
extern constinit thread_local std::uintptr_t stack_floor;

/// Where a page is missing, is it one that the stack of the main thread may not have? Async-signal-safe.
bool is_beyond_stack(const void* address) noexcept;

[[gnu::cold]] void look_at_stack(const void* frame);

/// Throws Failure where three quarters of the stack are used, or all but 512 kB. Cost: one comparison.
[[gnu::always_inline]] inline void check_stack() {
  const void* frame = __builtin_frame_address(0);
  if (reinterpret_cast<std::uintptr_t>(frame) < stack_floor) look_at_stack(frame);
}

}  // namespace pendula
