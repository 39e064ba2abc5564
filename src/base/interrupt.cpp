#include "base/interrupt.hpp"

#include "base/error.hpp"

namespace pendula {

std::atomic<bool> interrupt_requested{false};
std::atomic<void (*)()> interrupt_action{nullptr};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<void (*)()>::is_always_lock_free);

void request_interrupt() noexcept {
  interrupt_requested.store(true, std::memory_order_relaxed);
  if (auto* action = interrupt_action.load(std::memory_order_relaxed)) action();
}

void poll_interrupt() {
  if (interrupt_requested.load(std::memory_order_relaxed)) throw Interrupted();
}

}  // namespace pendula
