// Progress of long computations on a terminal.
#pragma once

#include <chrono>
#include <optional>
#include <string>

struct lua_State;

namespace pendula::lua {

/// Was the running function called from a line typed at the prompt? There Ctrl-C makes what is done so far
/// the value of the line; anywhere else the interrupt goes on and stops the script.
bool typed_at_prompt(lua_State* L);

/// The level of the stack at which a line typed at the prompt waits for the running function, with functions
/// of the library alone between them; 0: there is none.
int level_of_prompt(lua_State* L);

/// Progress of a computation in one line on standard error, overwritten and erased at the end; nothing where
/// standard error is no terminal.
class ProgressLine {
 public:
  using Milliseconds = std::chrono::milliseconds;
  /// Nothing is shown before `first` has passed, nor twice within `between`.
  ProgressLine(Milliseconds first, Milliseconds between);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool has_terminal() const { return terminal_; }
  /// Is it time for a line? Cost: reading the clock.
  bool due() const { return terminal_ && std::chrono::steady_clock::now() >= next_; }
  void show(const std::string& line);

 private:
  Milliseconds between_;
  bool terminal_, shown_ = false;
  std::chrono::steady_clock::time_point next_;
};

/// "sweep: 120 of 1000 runs, 35/s, 25 s left".
class CountProgress {
 public:
  /// title: "sweep"; what is counted: "runs".
  CountProgress(std::string title, std::string what, int count);
  void operator()(int done);

 private:
  std::string title_, what_;
  int count_;
  std::optional<int> first_, last_;  ///< shown
  ProgressLine line_;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace pendula::lua
