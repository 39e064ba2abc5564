// How much memory a script may take: Lua's own blocks are counted and capped, and C++ values that Lua only
// holds by a 16-byte handle make the collector run when the process grows.
#pragma once

#include <cstddef>
#include <string>

#include <lua.hpp>

namespace pendula::lua {

/// A state whose blocks may sum up to min(half of the machine's memory, 8 GiB); nullptr if memory is short.
/// lua_close frees everything.
lua_State* new_capped_state();

/// Another cap for this state; for tests.
void set_memory_cap(lua_State* L, size_t bytes);

/// Lowers the process's data limit to three quarters of the machine's memory (once; never
/// raises it), so that a C++ result that does not fit is an error and not the end of the
/// process. Nothing under the address sanitizer.
void limit_process_memory();

/// "script.lua:3: not enough memory (…)" for the last request that was refused.
std::string memory_message(lua_State* L);

/// While it lives there is room for an error text although the cap is reached.
class Reserve {
 public:
  explicit Reserve(lua_State* L);
  ~Reserve();
  Reserve(const Reserve&) = delete;
  Reserve& operator=(const Reserve&) = delete;

 private:
  size_t* cap_;
};

/// A full collection; what it frees goes back to the system.
void collect(lua_State* L);

/// A call of the library begins, inside which none is: from time to time, gives back the expressions that no
/// value of Lua refers to any more.
void begin_window_if_grown(lua_State* L);

/// Called whenever an object is handed to Lua. The collector sees only small handles;
/// every 64 objects this looks at the resident size of the process and runs a full
/// collection when it has doubled since the last one.
void collect_if_grown(lua_State* L);

}  // namespace pendula::lua
