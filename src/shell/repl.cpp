#include "shell/repl.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "lua/core/library.hpp"
#include "lua/core/objects.hpp"
#include "lua/screen/fit_text.hpp"
#include "lua/screen/pager.hpp"
#include "lua/session/state.hpp"
#include "shell/commands.hpp"
#include "shell/completion/complete.hpp"
#include "shell/completion/names.hpp"
#include "shell/echo.hpp"
#include "shell/entry.hpp"
#include "shell/input/journal.hpp"
#include "shell/input/reader.hpp"
#include "shell/input/signals.hpp"
#include "shell/input/terminal.hpp"
#include "shell/script.hpp"

namespace pendula::shell {
namespace {

bool is_defined(lua_State* L, const std::string& name) {
  const bool defined = push_global(L, name) != LUA_TNIL;
  lua_pop(L, 1);
  return defined;
}

/// The call for `path?`: help on the user's own value if there is one, else on the name.
std::string help_call(lua_State* L, const std::string& path) {
  const auto names = path_names(path);
  if (names.size() == 1)
    return name_kind(L, path) == NameKind::own ? "help(" + path + ")" : "help \"" + path + "\"";
  push_global(L, names[0]);
  const std::string type = lua::object_type(L, -1);
  lua_pop(L, 1);
  const char separator = path[names[0].size()];
  if (type.empty() || names.size() > 2) return "help \"" + path + "\"";
  return "help \"" + type + separator + names[1] + "\"";
}

/// Can the parts be evaluated one by one? Not if a variable <close> must live until the end of all parts.
bool all_complete(lua_State* L, const std::vector<std::string>& parts) {
  const int base = lua_gettop(L);
  const bool complete = std::all_of(parts.begin(), parts.end(), [&](const std::string& part) {
    return part.find("<close>") == std::string::npos && compile(L, part) == Reading::complete;
  });
  lua_settop(L, base);
  return complete;
}

class Session {
 public:
  explicit Session(lua_State* L)
      : L_(L),
        reader_(open_reader({[L](std::string_view text) { return complete(L, text); },
                             [this](const std::string& entry) { return is_complete(entry); },
                             [L](std::string_view name) { return name_kind(L, name); }})) {}

  void run();

 private:
  void feed(const std::string& text);
  bool is_complete(const std::string& text) const;
  bool command(const std::string& entry);
  void evaluate_pieces(const std::vector<std::string>& parts);
  bool evaluate(const std::string& entry) { return evaluate(entry, entry); }
  bool evaluate(const std::string& entry, const std::string& script);
  void record(const std::string& entry);
  void begin_journal();
  void recover();
  void report(const std::string& entry);

  lua_State* L_;
  std::unique_ptr<Reader> reader_;
  std::unique_ptr<Journal> journal_;  ///< if a person types the entries
  std::string pending_;               ///< the lines of an entry that is not complete yet
  bool leave_ = false;
  bool stopped_ = false;  ///< the last entry that failed was ended by Ctrl-C
};

void Session::run() {
  begin_journal();
  while (!leave_) {
    const Line line = reader_->read(pending_);
    if (line.kind == Line::Kind::text) {
      feed(line.text);
      recover();
      continue;
    }
    // Ctrl-D abandons an unfinished entry; it leaves the session only at an empty prompt.
    if (line.kind == Line::Kind::end) {
      std::puts("");
      leave_ = pending_.empty();
    }
    pending_.clear();
  }
}

void Session::feed(const std::string& text) {
  const bool first = pending_.empty();
  const std::string entry = first ? without_prompts(text) : text;
  if (trimmed(entry).empty() || (first && command(entry))) return;
  const Reading reading = compile(L_, entry);
  if (reading == Reading::incomplete) {
    pending_ = entry;
    return;
  }
  lua_pop(L_, 1);
  pending_.clear();
  reader_->remember(entry);
  const auto parts = pieces(L_, entry);
  // A chunk with goto or <close> across its statements runs as a whole.
  const bool whole = reading == Reading::complete && !all_complete(L_, parts);
  if (parts.size() < 2 || whole) {
    evaluate(entry);
  } else {
    evaluate_pieces(parts);
  }
}

bool Session::is_complete(const std::string& text) const {
  const std::string entry = without_prompts(text);
  if (!command_of(L_, entry).lua.empty() || !help_path(trimmed(entry)).empty()) return true;
  const Reading reading = compile(L_, entry);
  if (reading != Reading::incomplete) lua_pop(L_, 1);
  return reading != Reading::incomplete;
}

/// Handles entries that are not Lua: exit, commands and the question mark. A global variable of the same
/// name takes precedence.
bool Session::command(const std::string& entry) {
  const auto word = trimmed(entry);
  for (const char* name : {"exit", "quit"}) {
    if (word != name && word != std::string(name) + "()") continue;
    return leave_ = !is_defined(L_, name);
  }
  if (const Command command = command_of(L_, entry); !command.lua.empty()) {
    reader_->remember(entry);
    evaluate(command.lua, command.script);
    return true;
  }
  const std::string path = help_path(word);
  if (path.empty() && word != "help") return false;
  reader_->remember(entry);
  evaluate(path.empty() ? "help()" : help_call(L_, path), "");
  return true;
}

/// Stops at the first error, as if the lines had been typed one by one.
void Session::evaluate_pieces(const std::vector<std::string>& parts) {
  for (const auto& part : parts) {
    const Reading reading = compile(L_, part);
    if (reading == Reading::incomplete) {
      pending_ = part.substr(part.find_first_not_of('\n'));  // without the line breaks added for counting
      return;
    }
    lua_pop(L_, 1);
    if (!evaluate(part)) return;
  }
}

/// script: the text for the record of the session if the entry succeeds.
bool Session::evaluate(const std::string& entry, const std::string& script) {
  interrupt_requested = false;
  const int base = lua_gettop(L_);
  bool good = compile(L_, entry) == Reading::complete && lua::run(L_, 0, LUA_MULTRET);
  if (good && lua_gettop(L_) > base) {
    // the stack is full after a million values; some of them suffice
    if (!lua_checkstack(L_, 10)) lua_settop(L_, base + 100);
    lua_pushcfunction(L_, echo_values);
    lua_insert(L_, base + 1);
    good = lua::run(L_, lua_gettop(L_) - base - 1, 0);
  }
  if (good && !script.empty()) record(script);
  if (!good) report(entry);
  lua_settop(L_, base);
  interrupt_requested = false;
  std::fflush(stdout);
  return good;
}

/// Text that repeats the entry in a script: expressions are wrapped in print().
std::string as_script(lua_State* L, const std::string& entry) {
  const bool statement = luaL_loadstring(L, entry.c_str()) == LUA_OK;
  lua_pop(L, 1);
  return statement ? entry : "print(" + entry.substr(entry.find_first_not_of("= ")) + ")";
}

/// Appends the entry to the journal and to the file given to record "session.lua".
void Session::record(const std::string& entry) {
  if (entry.find("record") != entry.npos || entry.find("recover") != entry.npos) return;
  const std::string script = as_script(L_, entry);
  if (journal_) journal_->add(script);
  const int top = lua_gettop(L_);
  lua::push_stdlib_environment(L_);
  lua_pushliteral(L_, "record_file");
  if (lua_rawget(L_, -2) == LUA_TSTRING) std::ofstream(lua_tostring(L_, -1), std::ios::app) << script << "\n";
  lua_settop(L_, top);
}

/// Begins the journal of an interactive session and reports a journal left by a session that did
/// not end normally.
void Session::begin_journal() {
  if (!is_terminal(STDIN_FILENO)) return;
  journal_ = std::make_unique<Journal>();
  const std::string left = Journal::left_over();
  if (left.empty()) return;
  lua::push_stdlib_environment(L_);
  lua_pushstring(L_, left.c_str());
  lua_setfield(L_, -2, "left_over");
  lua_pop(L_, 1);
  lua::show_text(
      "A session ended unexpectedly. recover() runs its entries again, recover(false) forgets them.\n");
}

/// If the previous entry was recover(): runs the entries of the interrupted session one by one, so that a
/// failing entry does not prevent the others. They are added to the journal of this session.
void Session::recover() {
  lua::push_stdlib_environment(L_);
  lua_getfield(L_, -1, "recovering");
  const std::string path = lua_isstring(L_, -1) ? lua_tostring(L_, -1) : "";
  lua_pushboolean(L_, 0);
  lua_setfield(L_, -3, "recovering");
  lua_pop(L_, 2);
  if (path.empty()) return;
  stopped_ = false;
  for (const std::string& entry : Journal::entries(path)) {
    evaluate(std::string(trimmed(entry)));
    if (stopped_) return;  // by Ctrl-C: the journal is kept
  }
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
}

/// The position "stdin:1:" is dropped for an entry of one line; for several lines the line number is kept.
void Session::report(const std::string& entry) {
  stopped_ = lua::is_interrupt(L_, -1);
  if (stopped_) {
    // The terminal has just shown ^C.
    complain(is_terminal(STDIN_FILENO) ? "\ninterrupted" : "interrupted");
    return;
  }
  std::string message = lua_tostring(L_, -1);
  constexpr std::string_view chunk = "stdin:";
  if (message.rfind(chunk, 0) == 0) {
    const auto end = message.find(": ", chunk.size());
    const bool several = entry.find('\n') != std::string::npos;
    if (end != std::string::npos)
      message = (several ? "line " + message.substr(chunk.size(), end - chunk.size()) + ": " : "") +
                message.substr(end + 2);
  }
  complain(message);
}

}  // namespace

void run_session(lua_State* L) {
  use_utf8();
  if (is_terminal(STDIN_FILENO))
    lua::show_text(
        lua::fitted(text("Pendula ", PENDULA_VERSION, ", Lua for dynamic systems. help() gives an overview, ",
                         "Ctrl-D leaves."),
                    lua::screen_size().columns) +
        "\n");
  catch_interrupt_in_session();
  lua::page_long_text();
  Session(L).run();
}

}  // namespace pendula::shell
