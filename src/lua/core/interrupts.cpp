#include "lua/core/interrupts.hpp"

#include <atomic>

#include "base/error.hpp"
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

/// The prompt entry of which a part was computed: its function, and the line that it has reached.
struct KeptPart {
  const void* entry = nullptr;
  int line = 0;
};
KeptPart part;

/// Looks up the function at a level of the stack and its current line.
const void* function_at(lua_State* L, int level, lua_Debug& where) {
  if (!lua_getstack(L, level, &where)) return nullptr;
  lua_getinfo(L, "fl", &where);
  const void* function = lua_topointer(L, -1);
  lua_pop(L, 1);
  return function;
}

/// Stops the entry at a line that it has reached before, which means that a loop repeats.
void stop_loop(lua_State* L, lua_Debug*) {
  lua_Debug here;
  if (function_at(L, 0, here) != part.entry) return;
  if (here.currentline > part.line) {
    part.line = here.currentline;
    return;
  }
  lua_sethook(L, nullptr, 0, 0);
  push_interrupt_marker(L);
  lua_error(L);
}

/// This function is async-signal-safe.
void stop_running() {
  lua_State* L = running.load(std::memory_order_relaxed);
  if (L) lua_sethook(L, raise_marker, LUA_MASKCALL | LUA_MASKRET | LUA_MASKLINE | LUA_MASKCOUNT, 1);
}

}  // namespace

Running::Running(lua_State* L) : outer_(running.exchange(L)) {
  if (!outer_) part = {};
  interrupt_action.store(stop_running, std::memory_order_relaxed);
  // an interrupt requested before the handler knew L stops L instead
  if (interrupt_requested.load(std::memory_order_relaxed)) stop_running();
}

Running::~Running() {
  if (part.entry) lua_sethook(running.load(), nullptr, 0, 0);
  running.store(outer_);
  // a finalizer may have caught the marker at the end of this call; the caller has to stop as well
  if (outer_ && interrupt_requested.load(std::memory_order_relaxed)) stop_running();
}

void keep_part(lua_State* L, int level) {
  interrupt_requested = false;
  lua_Debug caller;
  part.entry = function_at(L, level, caller);
  part.line = caller.currentline;
  lua_sethook(L, stop_loop, LUA_MASKLINE, 0);
}

void refuse_after_part() {
  if (part.entry) throw Interrupted();
}

int call_with_handler(lua_State* L, lua_CFunction handler, int arguments, int results) {
  const int place = lua_gettop(L) - arguments;
  lua_pushcfunction(L, handler);
  lua_insert(L, place);
  int status = LUA_OK;
  {
    const Running running(L);
    status = lua_pcall(L, arguments, results, place);
  }
  lua_remove(L, place);
  return status;
}

lua_State* running_state() { return running.load(std::memory_order_relaxed); }

void push_interrupt_marker(lua_State* L) { lua_pushlightuserdata(L, &marker); }

bool is_interrupt_marker(lua_State* L, int index) {
  return lua_islightuserdata(L, index) && lua_touserdata(L, index) == &marker;
}

}  // namespace pendula::lua
