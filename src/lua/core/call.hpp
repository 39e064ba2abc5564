// How a C++ function is written for Lua: a function `int name(Call&)` and one row in the table of its file.
// The row carries signature, text, example and printed result, which feed help(), the manual and the doctest.
//
//   int reduce(Call& call) {
//     const auto& system = call.object<dae::Model>(1, "system");
//     const Options options = call.options(2);  // by the rows of options of this function
//     return call.push(dae::reduce(system, options.string("form", "acc")));
//   }
//
//   extern const Module dae_module = {"dae", "Differential-algebraic equations", {
//       {"model:reduce", reduce, "sys:reduce([form]) -> model",
//        R"(Lowers the index to 1 by differentiating the equations that hide constraints. The constraints
//           themselves are kept as conditions on the start.)",
//        R"(
//          x, y = vars "x y"
//          print(dae{ der(x) ~ y, x ~ sin(t) }:reduce():index()))",
//        "1"},
//   }};
//
// A binding computes nothing: it reads arguments, calls its layer and pushes the result. The folders are
// listed in lua/bind/modules.hpp; a new module is entered in modules.cpp.
//
// The name of a row says what the row is:
//
//   "sin"            a global function
//   "=pi"            a global value; its function is called once, at start-up
//   "rk.gauss"       a function of the library table rk
//   "=rk.rk4"        a value in that table
//   "dae"            beside rows "dae.…": the library table itself can be called
//   "model:reduce"   a method of the type "model"
//   "model#kind"     a field, computed when it is read
//   "model:__call"   a metamethod
//
// In signature and text a line end with its indentation counts as one blank. An example or a result that
// begins with a line end loses that line end and the indentation that its lines have in common.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lua.hpp>

#include "base/error.hpp"
#include "base/math.hpp"

namespace pendula::lua {

class Call;
using Function = int (*)(Call&);

/// One option of a function: what reads it, help, the completion of the prompt and error texts
/// know it from this row. A name that is a number is no option but that argument of the call, a
/// word to choose (reduce "acc").
struct OptionRow {
  const char* name;
  const char*
      type;  ///< what admits() knows, with " or " between: "number", "integer or list", "list of symbols"
  const char* fallback;  ///< as it would be written; "": none, or it depends
  const char* text;      ///< what it does, with its unit
  /// The admitted values: words with | between them, or where they come from: "@methods" (names of methods),
  /// "@variables", "@parameters", "@inputs" (keys of a table, or a list, of symbols of the model).
  const char* values = "";
};
using OptionTable = std::vector<OptionRow>;
/// The rows of two tables.
OptionTable joined(const OptionTable& first, const OptionTable& more);

/// Whether the value at `index` can be of a row's type: "number", "integer", "boolean", "string", "function"
/// and "expression" are what Lua says (an expression can be a number); all others are tables or objects. What
/// is in them is for the reader to say.
bool admits(std::string_view type, lua_State* L, int index);
/// Throws where the table at `index` has a key that is no row's name, or a value that no row admits.
void check_options(lua_State* L, int index, const OptionTable& known);

struct Row {
  const char* name;
  Function function;
  const char* signature;     ///< "sys:reduce([form]) -> model"; "" for a metamethod that help does not list
  const char* text;          ///< sentences
  const char* example = "";  ///< statements; the value of the last expression is printed and compared
  const char* gives = "";    ///< what the example prints
  const OptionTable* options = nullptr;
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

  /// The table of options at argument i (absent or nil: all fallbacks), by the rows of this function.
  Options options(int i) const;
  /// The same by other rows: of an argument that has options of its own.
  Options options(int i, const OptionTable& known) const;

  [[noreturn]] void wrong(int i, const char* name, const std::string& expected) const;
  /// " (usage: sin(x))", for the end of an error text; "" for rows without a signature.
  std::string usage() const;

  int push(double value) const;
  int push(long value) const;
  int push(int value) const { return push(static_cast<long>(value)); }
  int push(bool value) const;
  int push(const std::string& value) const;
  int push_nil() const;
  /// nil where there is no value.
  template <class T>
  int push(const std::optional<T>& value) const {
    return value ? push(*value) : push_nil();
  }
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
  int count_;
};

/// Marks the expressions in an object as used (touch() in expr/graph/graph.hpp).
using Touch = void (*)(const void* object);
/// Pushes a userdata that shares ownership of the object (for code outside a Call). It never
/// changes, or forgets (Remembered) what it has added. Without `touch` it keeps all
/// expressions of the windows of this call.
void push_object(lua_State* L, std::shared_ptr<const void> object, const char* type, Touch touch = nullptr);

/// "a number", "an integer".
std::string with_article(const std::string& noun);
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
