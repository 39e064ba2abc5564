// pendula: the interactive session, scripts, scripted tests.
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "lua/document/licences.hpp"
#include "lua/session/state.hpp"
#include "lua/session/testing.hpp"
#include "shell/grading/grade.hpp"
#include "shell/input/reader.hpp"
#include "shell/input/signals.hpp"
#include "shell/input/terminal.hpp"
#include "shell/options.hpp"
#include "shell/repl.hpp"
#include "shell/safe_mode.hpp"
#include "shell/script.hpp"

namespace pendula::shell {
namespace {

using State = std::unique_ptr<lua_State, decltype(&lua_close)>;

int run_tests(const Options& options) {
  catch_interrupt_in_script();
  return lua::run_tests(options.arguments);
}

int run_tool(const Options& options) {
  catch_interrupt_in_script();
  const State state(lua::new_state(), lua_close);
  try {
    return lua::run_tool(state.get(), options.tool, options.arguments);
  } catch (const Interrupted&) {
    complain("interrupted");
    return interrupted;
  }
}

/// Runs the code of -e, then the script; the first error ends the run.
Status run_scripts(lua_State* L, const Options& options, bool script_from_stdin) {
  for (const auto& code : options.code)
    if (const Status status = run_source(L, code, "=-e"); status != ok) return status;
  if (script_from_stdin) return run_file(L, "-", options.arguments);
  return options.script.empty() ? ok : run_file(L, options.script, options.arguments);
}

int run(const Options& options) {
  const bool nothing_given = options.code.empty() && options.script.empty() && !options.interactive;
  const bool person = is_terminal(STDIN_FILENO);
  const bool session = options.interactive || (nothing_given && person);
  catch_interrupt_in_script();
  const State state(lua::new_state(), lua_close);
  set_arguments(state.get(), options.before, options.script, options.arguments);
  const Status status =
      run_scripts(state.get(), options, options.script == "-" || (nothing_given && !person));
  // With -i, the state left by a failed script can be inspected; the exit status still reports the failure.
  if (session && status != interrupted) run_session(state.get());
  return status;
}

int grade(const Options& options) {
  catch_interrupt_in_session();
  grading::Request request;
  request.tasks = options.arguments.front();
  request.submissions.assign(options.arguments.begin() + 1, options.arguments.end());
  request.limits = options.limits;
  std::fflush(nullptr);
  try {
    const grading::Report report = grading::grade(request);
    std::fputs((options.json ? grading::json_report(report) : grading::text_report(report)).c_str(), stdout);
    return ok;
  } catch (const Interrupted&) {
    complain("interrupted");
    return interrupted;
  } catch (const UserFacing& e) {
    complain(std::string("pendula: ") + e.what());
    return usage;
  }
}

int dispatch(const Options& options) {
  if (!options.colour) refuse_colour();
  catch_broken_pipe();
  std::signal(SIGXFSZ, SIG_IGN);  // ulimit -f: the write fails instead, as on a full disk
  switch (options.action) {
    case Options::Action::version:
      std::printf("pendula %s (%s%s)\n", PENDULA_VERSION, LUA_RELEASE,
                  has_line_editing() ? ", with readline" : "");
      return ok;
    case Options::Action::licences:
      std::fputs(lua::licences_text().c_str(), stdout);
      return ok;
    case Options::Action::help:
      std::fputs(help_text(), stdout);
      return ok;
    case Options::Action::test:
      return run_tests(options);
    case Options::Action::tool:
      return run_tool(options);
    case Options::Action::grade:
      return grade(options);
    case Options::Action::run:
      return options.safe ? run_safely(options) : run(options);
  }
  return failed;
}

/// Makes the program fail if its output could not be written, for example on a full disk.
int check_output(int status) {
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && !std::ferror(stdout)) return status;
  // errno no longer has the reason of an earlier failure
  const char* why = flushed ? "a write failed" : std::strerror(errno);
  complain(std::string("pendula: cannot write standard output: ") + why + ".");
  return status == ok ? static_cast<int>(failed) : status;
}

}  // namespace
}  // namespace pendula::shell

int main(int argc, char** argv) {
  using namespace pendula::shell;
  pendula::raise_stack_limit();
  catch_exhausted_stack();
  try {
    return check_output(dispatch(parse_options({argv, argv + argc})));
  } catch (const UsageError& e) {
    complain(std::string("pendula: ") + e.what() + "\n'pendula --help' shows the options.");
    return usage;
  } catch (const std::bad_alloc&) {
    std::fputs("pendula: not enough memory\n", stderr);  // fputs does not allocate
    return failed;
  } catch (const std::exception& e) {
    complain(std::string("pendula: ") + e.what());
    return failed;
  }
}
