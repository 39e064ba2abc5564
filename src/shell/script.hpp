// Running what is not typed at the prompt: files, standard input, -e. The first error ends it.
//
// The folder is the program: main.cpp reads the command line (options.hpp) and starts a script
// (here), the session (repl.hpp, with entry.hpp, echo.hpp, commands.hpp, hints.hpp) or a script of
// somebody else (safe_mode.hpp).
#pragma once

#include <lua.hpp>

#include <string>
#include <vector>

namespace pendula::shell {

/// The exit status of the program.
enum Status { ok = 0, failed = 1, usage = 2, interrupted = 130 };

/// Sets the global `arg`: the script at 0, its arguments from 1 on, what stood before it below 0.
void set_arguments(lua_State* L, const std::vector<std::string>& before, const std::string& script,
                   const std::vector<std::string>& arguments);

/// The text of a script; "-" is standard input. Throws Error where it cannot be read.
std::string read_source(const std::string& path);
/// The name of its chunk as Lua wants it: "@exam.lua", "=stdin".
std::string chunk_name(const std::string& path);

/// Compiles and runs Lua text; false leaves the error on the stack.
bool run_text(lua_State* L, std::string source, const std::string& chunk,
              const std::vector<std::string>& arguments);

/// The error message, popped from the stack.
struct ScriptError {
  std::string text;
  bool interrupted;
};
ScriptError pop_error(lua_State* L);

/// Runs Lua source. `chunk` is its name as Lua wants it: "@exam.lua", "=stdin". The arguments become `...`.
/// An error goes to standard error as "file:line: text".
Status run_source(lua_State* L, std::string source, const std::string& chunk,
                  const std::vector<std::string>& arguments = {});

/// Reads and runs a file, or standard input if the path is "-".
Status run_file(lua_State* L, const std::string& path, const std::vector<std::string>& arguments);

/// Pops the error that run() left and prints it on standard error: text in red, or that it was Ctrl-C.
Status report_error(lua_State* L);

/// Writes a message and a line break to standard error, after everything printed so far.
void complain(const std::string& message);

}  // namespace pendula::shell
