#include "lua/core/interrupts.hpp"

#include <atomic>

#include "base/interrupt.hpp"

namespace pendula::lua {

namespace {

char marker;
std::atomic<lua_State*> running{nullptr};

void raise_marker(lua_State* L, lua_Debug*) {
  lua_sethook(L, nullptr, 0, 0);
  if (!interrupt_requested.load(std::memory_order_relaxed)) return;  // reported meanwhile
  push_interrupt_marker(L);
  lua_error(L);
}

/// Async-signal-safe.
void stop_running() {
  lua_State* L = running.load(std::memory_order_relaxed);
  if (L) lua_sethook(L, raise_marker, LUA_MASKCALL | LUA_MASKRET | LUA_MASKLINE | LUA_MASKCOUNT, 1);
}

}  // namespace

Running::Running(lua_State* L) : outer_(running.exchange(L)) {
  interrupt_action.store(stop_running, std::memory_order_relaxed);
  // Requested before L was known to the handler: stop L instead.
  if (interrupt_requested.load(std::memory_order_relaxed)) stop_running();
}

Running::~Running() {
  running.store(outer_);
  // Where the end of this call swallows the marker (a finalizer), the caller has to stop as well.
  if (outer_ && interrupt_requested.load(std::memory_order_relaxed)) stop_running();
}

lua_State* running_state() { return running.load(std::memory_order_relaxed); }

void push_interrupt_marker(lua_State* L) { lua_pushlightuserdata(L, &marker); }

bool is_interrupt_marker(lua_State* L, int index) {
  return lua_islightuserdata(L, index) && lua_touserdata(L, index) == &marker;
}

}  // namespace pendula::lua
