// Ctrl-C: the signal handler sets a flag, native loops poll it, a Lua hook raises it.
#pragma once

#include <atomic>

namespace pendula {

/// Set by the SIGINT handler (lock-free, hence async-signal-safe), cleared by whoever reports the interruption.
extern std::atomic<bool> interrupt_requested;

/// Throws Interrupted if Ctrl-C was pressed. Cost: one relaxed load; call it at least every millisecond.
void poll_interrupt();

}  // namespace pendula
