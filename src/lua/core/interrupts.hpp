// Ctrl-C in Lua code. A permanent count hook would halve the speed of every Lua loop (measured: 0.22 s → 0.43
// s), so the hook is set only when request_interrupt() is called, on the coroutine that runs at that moment;
// as in lua.c this is allowed from a signal handler. The hook raises a marker (a light userdata) that the
// pcall, xpcall and coroutine functions given to scripts pass on instead of catching.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// While it lives, L is the coroutine that request_interrupt() stops. Nested:
/// the destructor restores the outer one.
class Running {
 public:
  explicit Running(lua_State* L);
  ~Running();
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

 private:
  lua_State* outer_;
};

/// lua_pcall with a message handler; request_interrupt() stops it.
int call_with_handler(lua_State* L, lua_CFunction handler, int arguments, int results);

/// The innermost Running state, or nullptr.
lua_State* running_state();

/// Ctrl-C has ended a computation at the prompt, which returns its partial result. The entry that called it
/// continues, to store or draw that, but starts neither another round of a loop nor another computation of
/// this kind. level: where the entry stands on the stack. Clears interrupt_requested.
void keep_part(lua_State* L, int level = 1);
/// Throws Interrupted where an earlier part of the same entry was kept.
void refuse_after_part();

void push_interrupt_marker(lua_State* L);
bool is_interrupt_marker(lua_State* L, int index);

}  // namespace pendula::lua
