// Signals. While something computes, Ctrl-C sets pendula::interrupt_requested; while the prompt waits,
// signals are blocked except inside ppoll(), so that none arrives in the middle of a keystroke's work.
#pragma once

#include <csignal>

namespace pendula::shell {

/// Ctrl-C asks the running script to stop; a second one, while the first is unanswered, ends the process.
void catch_interrupt_in_script();

/// Ctrl-C asks the running computation to stop; repeated without effect, it says how to end the program.
void catch_interrupt_in_session();

/// Where the stack ends all the same (base/limits/stack.hpp), the program says so
/// and leaves no half-written file.
void catch_exhausted_stack();

/// A reader that went away (`pendula x.lua | head`) ends the process without a word; any other broken pipe is
/// an error of the write that met it.
void catch_broken_pipe();

/// Blocks the signals of the prompt as long as it lives.
class PromptSignals {
 public:
  PromptSignals();
  ~PromptSignals();
  PromptSignals(const PromptSignals&) = delete;
  PromptSignals& operator=(const PromptSignals&) = delete;

  /// Waits until `fd` can be read (0) or one of the signals arrives (its number).
  int wait(int fd) const;

 private:
  static constexpr int count_ = 5;
  sigset_t before_;
  struct sigaction actions_[count_];
};

/// Lets a signal do what it does by default: stop or end the process. Returns if the process is continued.
void default_action(int signal);

}  // namespace pendula::shell
