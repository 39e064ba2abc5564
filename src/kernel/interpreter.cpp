#include "kernel/interpreter.hpp"

#include <pthread.h>

#include <csignal>
#include <string_view>

#include <lua.hpp>
#include <xeus/xhelper.hpp>

#include "base/interrupt.hpp"
#include "lua/session/state.hpp"
#include "shell/completion/complete.hpp"
#include "shell/entry.hpp"
#include "shell/input/signals.hpp"

namespace pendula::kernel {
namespace {

/// Lets SIGINT through during its lifetime. A SIGINT that is already pending, sent while no cell
/// ran, is dropped.
class Interruptible {
 public:
  Interruptible() {
    sigemptyset(&interrupt_);
    sigaddset(&interrupt_, SIGINT);
    constexpr timespec at_once{0, 0};
    while (sigtimedwait(&interrupt_, nullptr, &at_once) > 0) continue;
    pthread_sigmask(SIG_UNBLOCK, &interrupt_, nullptr);
  }
  ~Interruptible() { pthread_sigmask(SIG_BLOCK, &interrupt_, nullptr); }
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

 private:
  sigset_t interrupt_;
};

std::string string_at(lua_State* L, int index) {
  std::size_t size = 0;
  const char* bytes = lua_tolstring(L, index, &size);
  return bytes ? std::string(bytes, size) : std::string();
}

class Interpreter final : public xeus::xinterpreter {
 public:
  Interpreter();
  ~Interpreter() override;

  /// Sends output of a cell to the front end: kind "stdout" with a text, or "display" or "result" with an
  /// object from MIME type to text.
  void publish(const std::string& kind, nl::json what);

 private:
  void configure_impl() override {}
  nl::json execute_request_impl(int number, const std::string& code, bool silent, bool store_history,
                                nl::json user_expressions, bool allow_stdin) override;
  nl::json complete_request_impl(const std::string& code, int cursor) override;
  nl::json inspect_request_impl(const std::string& code, int cursor, int detail) override;
  nl::json is_complete_request_impl(const std::string& code) override;
  nl::json kernel_info_request_impl() override;
  void shutdown_request_impl() override {}

  /// Pushes a function of stdlib/document/notebook.lua.
  void push_function(const char* name);

  lua_State* L_;
  int notebook_;    ///< reference to the table of stdlib/document/notebook.lua
  int number_ = 0;  ///< number of the cell that runs
  bool silent_ = false;
};

/// publish(kind, text or table from MIME type to text). Upvalue: the interpreter.
int publish_from_lua(lua_State* L) {
  auto* interpreter = static_cast<Interpreter*>(lua_touserdata(L, lua_upvalueindex(1)));
  if (!lua_istable(L, 2)) {
    interpreter->publish(string_at(L, 1), string_at(L, 2));
    return 0;
  }
  nl::json bundle = nl::json::object();
  lua_pushnil(L);
  while (lua_next(L, 2)) {
    bundle[string_at(L, -2)] = string_at(L, -1);
    lua_pop(L, 1);
  }
  interpreter->publish(string_at(L, 1), std::move(bundle));
  return 0;
}

/// The protocol counts characters (code points), we count bytes.
std::size_t byte_offset(std::string_view utf8, int characters) {
  std::size_t at = 0;
  for (int n = 0; at < utf8.size() && n < characters; ++n) do
      ++at;
    while (at < utf8.size() && (static_cast<unsigned char>(utf8[at]) & 0xC0) == 0x80);
  return at;
}

int characters_before(std::string_view utf8, std::size_t byte) {
  int n = 0;
  for (std::size_t i = 0; i < byte && i < utf8.size(); ++i)
    n += (static_cast<unsigned char>(utf8[i]) & 0xC0) != 0x80;
  return n;
}

Interpreter::Interpreter() : L_(lua::new_state()) {
  lua::push_part(L_, "document/notebook");
  lua_getfield(L_, -1, "set_up");
  if (!lua::run(L_, 0, 0)) throw std::runtime_error(string_at(L_, -1));
  notebook_ = luaL_ref(L_, LUA_REGISTRYINDEX);
  xeus::register_interpreter(this);
}

Interpreter::~Interpreter() { lua_close(L_); }

void Interpreter::push_function(const char* name) {
  lua_rawgeti(L_, LUA_REGISTRYINDEX, notebook_);
  lua_getfield(L_, -1, name);
  lua_remove(L_, -2);
}

void Interpreter::publish(const std::string& kind, nl::json what) {
  if (silent_) return;
  if (kind == "result") {
    publish_execution_result(number_, std::move(what), nl::json::object());
  } else if (kind == "display") {
    display_data(std::move(what), nl::json::object(), nl::json::object());
  } else {
    publish_stream("stdout", what.get<std::string>());
  }
}

nl::json Interpreter::execute_request_impl(int number, const std::string& code, bool silent, bool, nl::json,
                                           bool) {
  number_ = number;
  silent_ = silent;
  const int base = lua_gettop(L_);
  push_function("run");
  const std::string asked = shell::help_path(code);  // for example "reduce?"
  const std::string source = asked.empty() ? shell::globalize(code) : "help \"" + asked + "\"";
  lua_pushlstring(L_, source.data(), source.size());
  lua_pushstring(L_, ("=In[" + std::to_string(number) + "]").c_str());
  lua_pushlightuserdata(L_, this);
  lua_pushcclosure(L_, publish_from_lua, 1);
  interrupt_requested = false;
  bool good = false;
  {
    const Interruptible now;
    good = lua::run(L_, 3, 2);
  }
  // run() of notebook.lua returns the errors of a cell; the call itself fails only for Ctrl-C or an error
  // outside the user's code.
  const bool stopped = good ? lua_toboolean(L_, -1) : lua::is_interrupt(L_, -1);
  const std::string message = good ? string_at(L_, -2) : stopped ? "interrupted" : string_at(L_, -1);
  lua_settop(L_, base);
  interrupt_requested = false;
  if (message.empty()) return xeus::create_successful_reply();
  const std::string name = stopped ? "Interrupted" : "Error";
  if (!silent) publish_execution_error(name, message, {message});
  // Not create_error_reply(): its definition takes name and text in the opposite order of its declaration.
  return {{"status", "error"}, {"ename", name}, {"evalue", message}, {"traceback", {message}}};
}

nl::json Interpreter::complete_request_impl(const std::string& code, int cursor) {
  const std::size_t end = byte_offset(code, cursor);
  const shell::Completions found = shell::complete(L_, std::string_view(code).substr(0, end));
  return xeus::create_complete_reply(found.words, characters_before(code, found.begin),
                                     characters_before(code, end));
}

nl::json Interpreter::inspect_request_impl(const std::string& code, int cursor, int) {
  const int base = lua_gettop(L_);
  push_function("inspect");
  lua_pushlstring(L_, code.data(), code.size());
  lua_pushinteger(L_, static_cast<lua_Integer>(byte_offset(code, cursor)));
  const bool good = lua::run(L_, 2, 1);
  const std::string text = good ? string_at(L_, -1) : "";
  lua_settop(L_, base);
  if (text.empty()) return xeus::create_inspect_reply();
  return xeus::create_inspect_reply(true, {{"text/plain", text}});
}

nl::json Interpreter::is_complete_request_impl(const std::string& code) {
  const int base = lua_gettop(L_);
  const shell::Reading reading = shell::compile(L_, code);
  lua_settop(L_, base);
  if (reading == shell::Reading::incomplete) return xeus::create_is_complete_reply("incomplete", "  ");
  return xeus::create_is_complete_reply(reading == shell::Reading::complete ? "complete" : "invalid");
}

nl::json Interpreter::kernel_info_request_impl() {
  return xeus::create_info_reply("5.3", "pendula", PENDULA_VERSION, "lua", "5.4", "text/x-lua", ".lua", "lua",
                                 "lua", "", "Pendula " PENDULA_VERSION ", Lua for dynamic systems");
}

}  // namespace

std::unique_ptr<xeus::xinterpreter> make_interpreter() { return std::make_unique<Interpreter>(); }

}  // namespace pendula::kernel
