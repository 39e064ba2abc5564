// How a C++ function is written for Lua. A binding file holds small functions `int name(Call&)` and one table
// of rows; each row carries signature, text, example and the example's printed result, which feed help(), the
// manual and the doctest. No numerics here.
//
//   static int reduce(Call& call) {
//     const auto& system = call.object<dae::Model>(1, "system");
//     Options options = call.options(2, {"form", "gains"});
//     return call.push(dae::reduce(system, options.string("form", "acc")));
//   }
//   extern const Module dae_module = {"dae", "Differential-algebraic equations", {
//     {"model:reduce", reduce, "sys:reduce([form]) -> model", "Lowers the index …", "example code", "printed
//     result"}}};
//
// The name of a row says what it is:
//   "sin"           a global function                   "=pi"          a global value (called once at
//   start-up) "rk.gauss"      a function in the library table rk  "=rk.rk4"      a value in that table "dae"
//   together with "dae.linear": the library table dae is callable "model:reduce"  a method of the type named
//   "model"  "model#kind"   a field, computed when it is read "model:__call"  a metamethod
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include <lua.hpp>

#include "base/error.hpp"
#include "base/math.hpp"

namespace pendula::lua {

class Call;
using Function = int (*)(Call&);

struct Row {
  const char* name;
  Function function;
  const char* signature;
  const char* text;
  const char* example = "";  ///< statements; the value of the last expression is printed and compared
  const char* gives = "";    ///< what it prints
};

struct Module {
  const char* name;  ///< heading in help() and the manual
  const char* title;
  std::vector<Row> rows;
};

/// The Lua name of a C++ type: specialise with `static constexpr const char* value = "solution";`.
template <class T>
struct TypeName;

/// Reads a table of named options. Unknown keys are an error with "did you mean".
class Options {
 public:
  bool has(const char* key) const;
  double number(const char* key) const;  ///< required
  double number(const char* key, double fallback) const;
  long integer(const char* key, long fallback) const;
  bool boolean(const char* key, bool fallback) const;
  std::string string(const char* key) const;
  std::string string(const char* key, const std::string& fallback) const;
  /// Pushes the field's value (nil if absent) and returns its absolute stack index.
  int push(const char* key) const;

 private:
  friend class Call;
  Options(const Call* call, int index) : call_(call), index_(index) {}
  [[noreturn]] void wrong(const char* key, const char* expected) const;
  const Call* call_;
  int index_;  ///< absolute stack index of the table; 0: no table was given
};

/// One call from Lua: typed arguments in, values out. Indices are 1-based; `name` is the argument's name in
/// the signature and appears in error texts: "bad argument #2 'dt': expected a number, got nil".
class Call {
 public:
  Call(lua_State* state, const Row& row);

  lua_State* L;
  const Row& row;

  int count() const { return count_; }  ///< number of arguments given
  bool has(int i) const;                ///< given and not nil

  double number(int i, const char* name) const;  ///< numbers only; a numeric string is an error
  double number(int i, const char* name, double fallback) const;
  long integer(int i, const char* name) const;  ///< 3 and 3.0, not 3.5
  long integer(int i, const char* name, long fallback) const;
  bool boolean(int i, const char* name) const;
  std::string string(int i, const char* name) const;
  std::string string(int i, const char* name, const std::string& fallback) const;
  void function(int i, const char* name) const;  ///< throws unless callable
  void table(int i, const char* name) const;     ///< throws unless a table

  template <class T>
  bool is(int i) const {
    return test(i, TypeName<T>::value) != nullptr;
  }
  template <class T>
  const T& object(int i, const char* name) const {
    return *shared<T>(i, name);
  }
  template <class T>
  std::shared_ptr<const T> shared(int i, const char* name) const {
    return std::static_pointer_cast<const T>(required(i, TypeName<T>::value, name));
  }

  /// The table of options at argument i (absent or nil: all fallbacks). Throws on unknown keys and non-string
  /// keys.
  Options options(int i, std::initializer_list<const char*> known) const;

  [[noreturn]] void wrong(int i, const char* name, const std::string& expected) const;

  int push(double value) const;
  int push(long value) const;
  int push(int value) const { return push(static_cast<long>(value)); }
  int push(bool value) const;
  int push(const std::string& value) const;
  int push(const char* value) const { return push(std::string(value)); }
  template <class T>
  int push(std::shared_ptr<const T> object) const {
    push_shared(L, std::move(object), TypeName<T>::value);
    return 1;
  }

 private:
  std::shared_ptr<const void>* test(int i, const char* type) const;
  std::shared_ptr<const void> required(int i, const char* type, const char* name) const;
  static void push_shared(lua_State* L, std::shared_ptr<const void> object, const char* type);
  friend void push_object(lua_State*, std::shared_ptr<const void>, const char*);
  int count_;
};

/// Pushes a userdata that shares ownership of the object (for code outside a Call).
void push_object(lua_State* L, std::shared_ptr<const void> object, const char* type);

/// The type name of the value at `index` as a user would say it: "a number", "nil", "a solution".
std::string describe(lua_State* L, int index);

/// Calls the function below its `arguments` arguments; a Lua error is thrown on as LuaError (position kept),
/// an interrupt as Interrupted. Every call from C++ back into Lua goes through here.
void protected_call(lua_State* L, int arguments, int results);

/// An error raised inside a Lua callback: the text already carries script and line, none is added.
class LuaError : public UserFacing {
 public:
  using UserFacing::UserFacing;
};

}  // namespace pendula::lua
