#include "lua/core/function_reference.hpp"

#include "lua/core/interrupts.hpp"

namespace pendula::lua {

namespace {

lua_State* main_thread(lua_State* L) {
  lua_rawgeti(L, LUA_REGISTRYINDEX, LUA_RIDX_MAINTHREAD);
  lua_State* const thread = lua_tothread(L, -1);
  lua_pop(L, 1);
  return thread;
}

}  // namespace

FunctionReference::FunctionReference(lua_State* L, int index) : main_(main_thread(L)) {
  lua_pushvalue(L, index);
  reference_ = luaL_ref(L, LUA_REGISTRYINDEX);
}

FunctionReference::~FunctionReference() { luaL_unref(main_, LUA_REGISTRYINDEX, reference_); }

lua_State* FunctionReference::push() const {
  lua_State* L = running_state();
  if (!L || main_thread(L) != main_) L = main_;
  luaL_checkstack(L, LUA_MINSTACK + 1, nullptr);
  lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
  return L;
}

}  // namespace pendula::lua
