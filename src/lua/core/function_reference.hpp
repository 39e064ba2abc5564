// A Lua function that C++ may call later.
#pragma once

#include <lua.hpp>

namespace pendula::lua {

/// Keeps a Lua function alive through the registry for as long as some callback holds it. Must not outlive L.
class FunctionReference {
 public:
  FunctionReference(lua_State* L, int index) : L_(L) {
    lua_pushvalue(L, index);
    reference_ = luaL_ref(L, LUA_REGISTRYINDEX);
  }
  FunctionReference(const FunctionReference&) = delete;
  FunctionReference& operator=(const FunctionReference&) = delete;
  ~FunctionReference() { luaL_unref(L_, LUA_REGISTRYINDEX, reference_); }
  void push() const { lua_rawgeti(L_, LUA_REGISTRYINDEX, reference_); }
  lua_State* state() const { return L_; }

 private:
  lua_State* L_;
  int reference_;
};

}  // namespace pendula::lua
