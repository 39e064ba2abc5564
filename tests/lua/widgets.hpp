// A binding module as bindings are written, for the tests of the Lua layer: a type with
// methods, fields, operators and integer keys, functions that read every kind of argument, and
// functions that go wrong in every way.
#pragma once

#include <memory>
#include <string>

#include "lua/core/call.hpp"
#include "lua/core/library.hpp"
#include "lua/session/state.hpp"

namespace pendula::lua {

struct Widget {
  double size = 0;
};

template <>
struct TypeName<Widget> {
  static constexpr const char* value = "widget";
};

extern const Module widgets;

/// A state with the widgets in it, closed at the end of the scope.
class Session {
 public:
  Session() : L(new_state()) { add_module(L, widgets); }
  ~Session() { lua_close(L); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Runs the script as file "user.lua"; returns "ok", the first result's text,
  /// "interrupted", or the error text.
  std::string operator()(const std::string& script);

  lua_State* const L;
};

}  // namespace pendula::lua
