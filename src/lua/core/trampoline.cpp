#include "lua/core/trampoline.hpp"

#include <cstring>
#include <map>
#include <new>
#include <stdexcept>
#include <utility>

#include "base/interrupt.hpp"
#include "base/limits/stack.hpp"
#include "lua/core/documentation.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/memory.hpp"
#include "lua/core/signature.hpp"

namespace pendula::lua {

namespace {

/// The last error of a callback: { text =, value =, callers = }. passed = true once it has propagated to the
/// lines that called the library function.
char kept_error_key;

/// Pushes the kept error if its text is `message`; else nothing.
bool push_kept_error(lua_State* L, const char* message) {
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &kept_error_key) == LUA_TTABLE) {
    lua_getfield(L, -1, "text");
    const char* kept = lua_tostring(L, -1);
    const bool same = kept && std::strcmp(kept, message) == 0;
    lua_pop(L, 1);
    if (same) return true;
  }
  lua_pop(L, 1);
  return false;
}

/// Did this error pass through a callback? Then pushes its callers.
bool push_callers_of_callback(lua_State* L, const char* message) {
  if (!push_kept_error(L, message)) return false;
  lua_getfield(L, -1, "passed");
  lua_getfield(L, -2, "callers");
  const bool passed = lua_toboolean(L, -2) && lua_isstring(L, -1);
  lua_replace(L, -3);
  lua_pop(L, passed ? 1 : 2);
  return passed;
}

/// Pushes the error object that protected_call kept for this text, or the text itself.
void push_lua_error(lua_State* L, const char* message) {
  if (!push_kept_error(L, message)) {
    lua_pushstring(L, message);
    return;
  }
  lua_pushboolean(L, 1);
  lua_setfield(L, -2, "passed");
  lua_getfield(L, -1, "value");
}

void push_message(lua_State* L, const std::string& name, const std::string& what) {
  const std::string message = user_position(L) + (name.empty() ? "" : name + ": ") + what;
  lua_pushlstring(L, message.data(), message.size());
}

/// Pushes the exception being handled as a Lua error value.
void push_exception(lua_State* L, const std::string& name) {
  try {
    throw;
  } catch (const LuaError& e) {
    push_lua_error(L, e.what());
  } catch (const UserFacing& e) {
    push_message(L, name, e.what());
  } catch (const Interrupted&) {
    push_interrupt_marker(L);
  } catch (const std::bad_alloc&) {
    push_message(L, name, "not enough memory for a result of this size");
  } catch (const std::length_error&) {
    push_message(L, name, "not enough memory for a result of this size");
  } catch (const std::exception& e) {
    push_message(
        L, "",
        text("internal error in ", name.empty() ? "pendula" : name, ": ", e.what(), " (please report)"));
  }
}

/// A running library function; its callbacks can call others.
class RunningRow {
 public:
  RunningRow() { ++depth_; }
  ~RunningRow() { --depth_; }
  RunningRow(const RunningRow&) = delete;
  RunningRow& operator=(const RunningRow&) = delete;
  static bool none() { return depth_ == 0; }

 private:
  static inline int depth_ = 0;
};

int trampoline(lua_State* L) {
  const Row& row = *static_cast<const Row*>(lua_touserdata(L, lua_upvalueindex(1)));
  try {
    poll_interrupt();
    check_stack();  // for callbacks nested in callbacks
    if (RunningRow::none()) begin_window_if_grown(L);
    const RunningRow running;
    luaL_checkstack(L, 40, "too many arguments");
    refuse_more_arguments(L, row.name, row.signature, lua_upvalueindex(2));
    Call call(L, row);
    return row.function(call);
  } catch (const std::exception&) {  // not (...): Lua's own errors must pass
    push_exception(L, shown_name(row.name));
  }
  return lua_error(L);
}

}  // namespace

void refuse_more_arguments(lua_State* L, std::string_view name, std::string_view signature, int count) {
  auto most = static_cast<int>(lua_tointeger(L, count));
  if (most < 0) {  // not counted yet
    most = most_arguments(name, signature);
    lua_pushinteger(L, most);
    lua_replace(L, count);
  }
  int given = lua_gettop(L);
  while (given > most && lua_isnil(L, given)) --given;
  if (given <= most) return;
  const int object = name.find(':') == name.npos ? 0 : 1;
  // the function itself reports better what its table must be: integrate(0, 1)
  const bool table = signature.substr(0, signature.find("->")).find('{') != signature.npos;
  if (most - object == 1 && table && !lua_istable(L, most)) return;
  throw Error(text("expected ", most == object ? "no" : text(most - object),
                   most - object == 1 ? " argument" : " arguments", ", got ", given - object,
                   " (usage: ", prose(signature), ")"));
}

int guard(lua_State* L, int (*body)(lua_State*)) {
  try {
    return body(L);
  } catch (const std::exception&) {
    push_exception(L, "");
  }
  return lua_error(L);
}

void push_row(lua_State* L, const Row& row) {
  lua_pushlightuserdata(L, const_cast<Row*>(&row));
  lua_pushinteger(L, -1);
  lua_pushcclosure(L, trampoline, 2);
}

std::string shown_name(const std::string& row_name) {
  static const std::map<std::string, std::string> operators = {
      {"__add", "+"},   {"__sub", "-"},    {"__mul", "*"},
      {"__div", "/"},   {"__mod", "%"},    {"__pow", "^"},
      {"__idiv", "//"}, {"__unm", "-"},    {"__concat", ".."},
      {"__len", "#"},   {"__eq", "=="},    {"__lt", "<"},
      {"__le", "<="},   {"__bxor", "~"},   {"__band", "&"},
      {"__bor", "|"},   {"__shl", "<<"},   {"__shr", ">>"},
      {"__bnot", "~"},  {"__index", "[]"}, {"__tostring", "tostring"},
      {"__exp", "exp"}};
  if (!row_name.empty() && row_name[0] == '=') return shown_name(row_name.substr(1));
  const size_t separator = row_name.find_first_of(":#");
  if (separator == std::string::npos) return row_name;
  const std::string member = row_name.substr(separator + 1);
  if (member == "__call") return row_name.substr(0, separator);
  const auto found = operators.find(member);
  return found == operators.end() ? member : found->second;
}

static bool is_ours(const lua_Debug& frame) { return std::strncmp(frame.source, "=stdlib/", 8) == 0; }

/// The level of the innermost line of user code; the number of levels if there is none.
static int user_level(lua_State* L) {
  lua_Debug frame;
  const auto is_behind = [&](int level) {  // outside the running library functions
    if (lua_getstack(L, level, &frame) == 0) return true;
    lua_getinfo(L, "Sl", &frame);
    return frame.currentline > 0 && !is_ours(frame);
  };
  constexpr int near = 1000;
  for (int level = 0; level < near; ++level)
    if (is_behind(level)) return level;
  // Bisection, for a library function that calls itself 100 000 times: lua_getstack counts from the top, and
  // inspecting all levels would cost the square of their number.
  int inside = near - 1, behind = 2 * near;
  while (!is_behind(behind)) inside = std::exchange(behind, 2 * behind);
  while (behind - inside > 1) {
    const int middle = inside + (behind - inside) / 2;
    (is_behind(middle) ? behind : inside) = middle;
  }
  return behind;
}

std::string user_position(lua_State* L) {
  lua_Debug frame;
  if (lua_getstack(L, user_level(L), &frame) == 0) return "";
  lua_getinfo(L, "Sl", &frame);
  // Lua truncates short_src to 60 characters; the full file name lets editors jump to it.
  const char* source = frame.source[0] == '@' ? frame.source + 1 : frame.short_src;
  return text(source, ":", frame.currentline, ": ");
}

/// Advice that Lua's own message lacks, for a call or length of a value of the wrong type.
static std::string remedy_for_lua_error(const std::string& message) {
  const auto quoted = [&] {
    const auto begin = message.find('\'') + 1;
    return message.substr(begin, message.find('\'', begin) - begin);
  };
  const auto says = [&](const char* words) { return message.find(words) != message.npos; };
  if (says("attempt to get length of a solution")) return ": the number of saved points is #sol.t";
  if (says("attempt to call a nil value (method 'value')"))
    return ": the number of an expression is evaluate(e), the default of a parameter m.value";
  if (says("attempt to yield across a C-call boundary"))
    return ": a callback gives its result by return, and cannot wait in coroutine.yield";
  if (says("attempt to yield from outside a coroutine"))
    return ": coroutine.yield works in a function that coroutine.wrap or coroutine.create runs, not in a callback";
  if (!says("attempt to call a") || says("attempt to call a nil")) return "";
  if (says("(method '")) return text(": ", quoted(), " is a value, not a function: write it without ( )");
  if (says("call a number value")) return ": a product is written with *, as in 2*(x + 1)";
  if (says("call a model value")) return ": it is integrated by sys:integrate{ start = { x = 1 }, to = 10 }";
  if (says("call a tableau value"))
    return ": a method is an option: sys:integrate{ …, method = rk.euler, dt = 0.01 }";
  if (says("call a rk value")) return ": a tableau of your own is tableau{ A = …, b = … }";
  if (says("call a matrix value")) return ": a product is written with *, as in A*(x + y)";
  if ((says("call a table value") || says("call a list value")) && says("'"))
    return text(": an entry of a list is ", quoted(), "[1]");
  return "";
}

std::string blamed_on_caller(lua_State* L, const std::string& message) {
  const auto line = message.find(".lua:");
  const auto end = line == message.npos ? line : message.find(": ", line + 5);
  if (message.starts_with("attempt to yield"))
    return user_position(L) + message + remedy_for_lua_error(message);
  if (!message.starts_with("stdlib/") || end == message.npos) return message + remedy_for_lua_error(message);
  const std::string what = message.substr(end + 2);
  std::string name;
  lua_Debug frame;
  for (int level = user_level(L) - 1; level >= 0 && lua_getstack(L, level, &frame) != 0; --level) {
    lua_getinfo(L, "Sn", &frame);
    if (!is_ours(frame)) continue;
    name = frame.name ? frame.name : "";  // of the outermost call; unknown after a tail call
    break;
  }
  if (!what.starts_with("attempt to ")) return user_position(L) + what;  // written for users already
  if (name.empty()) return text(user_position(L), "an argument does not fit: ", what);
  return text(user_position(L), name, ": an argument does not fit: ", what, "; help \"", name,
              "\" shows the arguments");
}

std::string error_text(lua_State* L, int index) {
  if (lua_type(L, index) == LUA_TSTRING || lua_type(L, index) == LUA_TNUMBER) {
    lua_pushvalue(L, index);  // lua_tolstring would change a number in place
    size_t size = 0;
    const char* bytes = lua_tolstring(L, -1, &size);
    std::string message(bytes, size);
    lua_pop(L, 1);
    return message;
  }
  if (luaL_getmetafield(L, index, "__tostring") != LUA_TNIL) {
    lua_pushvalue(L, index < 0 ? index - 1 : index);
    const bool good = lua_pcall(L, 1, 1, 0) == LUA_OK && lua_type(L, -1) == LUA_TSTRING;
    std::string message = good ? lua_tostring(L, -1) : "an error object whose __tostring fails";
    lua_pop(L, 1);
    return message;
  }
  return text("error() was called with ", describe(L, index), " instead of a message");
}

std::string callers(lua_State* L, const std::string& message) {
  if (push_callers_of_callback(L, message.c_str())) {
    const std::string kept = lua_tostring(L, -1);
    lua_pop(L, 1);
    return kept;
  }
  constexpr int most = 8;
  // lua_getstack counts from the top: inspecting all levels would cost the square of their number
  constexpr int deepest = 1000;
  std::string lines, last;
  lua_Debug frame;
  int found = 0;
  for (int level = 0; lua_getstack(L, level, &frame) != 0; ++level) {
    if (level == deepest) return lines + "\n  …";
    lua_getinfo(L, "Sl", &frame);
    if (frame.currentline <= 0 || std::strncmp(frame.source, "=stdlib/", 8) == 0) continue;
    const std::string place = text(frame.source + 1, ":", frame.currentline);
    if (place == std::exchange(last, place)) continue;
    if (++found == 1) continue;  // the line with which the message begins
    if (found > most + 1) return lines + "\n  …";
    if (frame.source[0] == '@') lines += "\n  called from " + place;
  }
  return lines;
}

int keep_error(lua_State* L) {
  if (is_interrupt_marker(L, 1)) return 1;
  const std::string message = error_text(L, 1);
  const std::string lines = callers(L, message);
  lua_createtable(L, 0, 4);
  lua_pushlstring(L, message.data(), message.size());
  lua_setfield(L, -2, "text");
  lua_pushlstring(L, lines.data(), lines.size());
  lua_setfield(L, -2, "callers");
  lua_pushvalue(L, 1);
  lua_setfield(L, -2, "value");
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kept_error_key);
  lua_settop(L, 1);
  return 1;
}

}  // namespace pendula::lua
