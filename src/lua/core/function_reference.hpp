// A Lua function that C++ may call later.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Keeps a Lua function alive through the registry for as long as some callback holds it. Must not outlive
/// the Lua state; the coroutine that made it may end and be collected before.
class FunctionReference {
 public:
  FunctionReference(lua_State* L, int index);
  FunctionReference(const FunctionReference&) = delete;
  FunctionReference& operator=(const FunctionReference&) = delete;
  ~FunctionReference();
  /// Pushes the function onto the stack of the coroutine that runs now and returns that coroutine; there is
  /// room for 20 values more.
  lua_State* push() const;

 private:
  lua_State* main_;
  int reference_;
};

}  // namespace pendula::lua
