#include "shell/script.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "lua/screen/pager.hpp"
#include "lua/session/state.hpp"
#include "shell/hints.hpp"
#include "shell/input/terminal.hpp"

namespace pendula::shell {
namespace {

/// Reads the whole file; nothing on failure, with errno set: EINTR for Ctrl-C during the wait.
std::optional<std::string> read_all(std::FILE* file) {
  std::string source;
  char chunk[1 << 14];
  std::size_t count = 0;
  while ((count = std::fread(chunk, 1, sizeof chunk, file)) > 0) source.append(chunk, count);
  if (std::ferror(file)) return std::nullopt;
  return source;
}

std::optional<std::string> read_file(const std::string& path) {
  if (path == "-") return read_all(stdin);
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (!file) return std::nullopt;
  auto source = read_all(file);
  const int error = errno;
  std::fclose(file);
  errno = error;
  return source;
}

/// Removes a byte order mark and a shebang line without changing the line numbers.
void skip_preamble(std::string& source) {
  if (source.rfind("\xEF\xBB\xBF", 0) == 0) source.erase(0, 3);
  if (source.rfind('#', 0) == 0) source.erase(0, source.find('\n'));
}

/// " Did you mean 'exam.lua'?" if the folder of a missing file has a Lua file with a similar name.
std::string similar_file(const std::string& path) {
  const std::filesystem::path wanted(path);
  const auto folder = wanted.has_parent_path() ? wanted.parent_path() : std::filesystem::path(".");
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
    if (entry.path().extension() == ".lua") names.push_back(entry.path().filename().string());
  return did_you_mean(wanted.filename().string(), names);
}

std::string why_not_read(const std::string& path, int error) {
  const std::string message = "cannot read '" + path + "': " + std::strerror(error) + ".";
  return error == ENOENT ? message + similar_file(path) : message;
}

Status cannot_read(const std::string& path, int error) {
  if (error == EINTR && interrupt_requested) {
    complain("interrupted");
    return interrupted;
  }
  complain("pendula: " + why_not_read(path, error));
  return failed;
}

/// Replaces the error text of the parser on the stack by one with a hint; the message about too many brackets
/// is replaced because it has no position.
void add_hint(lua_State* L, const std::string& source, const std::string& chunk) {
  std::string error = lua_tostring(L, -1);
  if (error.starts_with("C stack overflow"))
    error = chunk.substr(1) + ": brackets, functions or blocks are nested more than 190 deep";
  error += syntax_hint(source, error);
  lua_pushlstring(L, error.data(), error.size());
}

}  // namespace

void complain(const std::string& message) {
  std::fflush(stdout);
  const std::string line = red(lua::for_errors(message), STDERR_FILENO) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
}

ScriptError pop_error(lua_State* L) {
  ScriptError error{"interrupted", lua::is_interrupt(L, -1)};
  std::size_t length = 0;
  const char* text = error.interrupted ? nullptr : lua_tolstring(L, -1, &length);
  if (!error.interrupted) error.text = text ? std::string(text, length) : "an error without a text";
  lua_pop(L, 1);
  return error;
}

Status report_error(lua_State* L) {
  const ScriptError error = pop_error(L);
  complain(error.text);
  return error.interrupted ? interrupted : failed;
}

void set_arguments(lua_State* L, const std::vector<std::string>& before, const std::string& script,
                   const std::vector<std::string>& arguments) {
  lua_createtable(L, static_cast<int>(arguments.size()), static_cast<int>(before.size() + 1));
  const auto set = [&](const std::string& value, lua_Integer index) {
    lua_pushlstring(L, value.data(), value.size());
    lua_rawseti(L, -2, index);
  };
  // As in lua.c: without a script, index 0 is the program itself.
  const auto shift = static_cast<lua_Integer>(before.size()) - (script.empty() ? 1 : 0);
  for (std::size_t i = 0; i < before.size(); ++i) set(before[i], static_cast<lua_Integer>(i) - shift);
  if (!script.empty()) set(script, 0);
  for (std::size_t i = 0; i < arguments.size(); ++i) set(arguments[i], static_cast<lua_Integer>(i + 1));
  lua_setglobal(L, "arg");
  lua::search_script_folder(L, script);
}

bool run_text(lua_State* L, std::string source, const std::string& chunk,
              const std::vector<std::string>& arguments) {
  skip_preamble(source);
  if (source.starts_with(LUA_SIGNATURE)) {
    lua_pushstring(L, (chunk.substr(1) + ": this is binary Lua code (bytecode); only text is run").c_str());
    return false;
  }
  if (luaL_loadbufferx(L, source.data(), source.size(), chunk.c_str(), "t") != LUA_OK) {
    add_hint(L, source, chunk);
    return false;
  }
  if (!lua_checkstack(L, static_cast<int>(arguments.size()) + 10)) {
    lua_settop(L, 0);
    lua_pushliteral(L, "pendula: too many arguments");
    return false;
  }
  for (const auto& argument : arguments) lua_pushlstring(L, argument.data(), argument.size());
  return lua::run(L, static_cast<int>(arguments.size()), 0);
}

Status run_source(lua_State* L, std::string source, const std::string& chunk,
                  const std::vector<std::string>& arguments) {
  return run_text(L, std::move(source), chunk, arguments) ? ok : report_error(L);
}

std::string read_source(const std::string& path) {
  auto source = read_file(path);
  if (!source) throw Error(why_not_read(path, errno));
  return std::move(*source);
}

std::string chunk_name(const std::string& path) { return path == "-" ? "=stdin" : "@" + path; }

Status run_file(lua_State* L, const std::string& path, const std::vector<std::string>& arguments) {
  auto source = read_file(path);
  if (!source) return cannot_read(path, errno);
  return run_source(L, std::move(*source), chunk_name(path), arguments);
}

}  // namespace pendula::shell
