// Ctrl-C: the signal handler sets a flag, native loops poll it, a Lua hook raises it.
#pragma once

#include <atomic>

namespace pendula {

/// Set by the SIGINT handler (lock-free, hence async-signal-safe), cleared by
/// whoever reports the interruption.
extern std::atomic<bool> interrupt_requested;

/// A further action at once, e.g. stopping a Lua loop: async-signal-safe, null if there is nothing to
/// do. Set by the Lua layer.
extern std::atomic<void (*)()> interrupt_action;

/// For the SIGINT handler: sets the flag and runs the action. Threads other than the one
/// that runs Lua must block SIGINT.
void request_interrupt() noexcept;

/// Throws Interrupted if Ctrl-C was pressed. Cost: one relaxed load; call it at least every millisecond.
void poll_interrupt();

}  // namespace pendula
