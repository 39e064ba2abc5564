#include "shell/input/signals.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <ctime>

#include "base/files/draft.hpp"
#include "base/files/temporary.hpp"
#include "base/interrupt.hpp"
#include "base/limits/stack.hpp"

namespace pendula::shell {
namespace {

constexpr std::array<int, 5> prompt_signals = {SIGINT, SIGTSTP, SIGTERM, SIGHUP, SIGWINCH};

volatile std::sig_atomic_t arrived = 0;
std::atomic<std::time_t> first_request{0};

extern "C" void note_signal(int signal) { arrived = signal; }

extern "C" void on_interrupt(int) { request_interrupt(); }

// Only async-signal-safe calls: time, write.
extern "C" void on_interrupt_again(int) {
  const int saved = errno;
  const std::time_t now = std::time(nullptr);
  if (!interrupt_requested.load()) {
    first_request = now;
  } else if (now - first_request >= 2) {
    constexpr char text[] = "\nstill busy in a call that cannot be interrupted; Ctrl-\\ ends the program\n";
    (void)!write(STDERR_FILENO, text, sizeof text - 1);
  }
  request_interrupt();
  errno = saved;
}

/// Is the reading end of this descriptor gone?
bool broken(int fd) {
  pollfd p{fd, 0, 0};
  return poll(&p, 1, 0) > 0 && (p.revents & POLLERR);
}

void remove_unfinished_files() {
  remove_drafts();
  remove_temporary_files();
}

extern "C" void leave_broken_pipe(int signal) {
  const int saved = errno;
  // Raised again with the default action, it ends the process as soon as this handler returns.
  if (broken(STDOUT_FILENO) || broken(STDERR_FILENO)) {
    remove_unfinished_files();
    std::signal(signal, SIG_DFL);
    raise(signal);
  }
  errno = saved;
}

extern "C" void end_without_drafts(int signal) {
  remove_unfinished_files();
  raise(signal);  // its action is the default one again
}

/// A recursion that does not ask how much of the stack is left has come to its end:
/// there is none to go on with.
extern "C" void end_without_stack(int signal, siginfo_t* info, void*) {
  if (is_beyond_stack(info->si_addr)) {
    constexpr char text[] =
        "pendula: the stack is used up, something is nested too deeply for it; a larger one is given by "
        "'ulimit -s unlimited' before the program starts\n";
    (void)!write(STDERR_FILENO, text, sizeof text - 1);
    remove_unfinished_files();
    _exit(1);
  }
  raise(signal);  // its action is the default one again
}

/// Without SA_RESTART: a script that waits for input must notice Ctrl-C too.
void handle(int signal, void (*handler)(int), int flags = 0) {
  struct sigaction action = {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

}  // namespace

/// What ends the process from outside does so, but leaves no half-written file.
static void catch_end() {
  for (int signal : {SIGTERM, SIGHUP}) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (before.sa_handler == SIG_DFL) handle(signal, end_without_drafts, SA_RESETHAND);
  }
}

void catch_interrupt_in_script() {
  catch_end();
  handle(SIGINT, on_interrupt, SA_RESETHAND);
}
void catch_interrupt_in_session() {
  catch_end();
  handle(SIGINT, on_interrupt_again);
}
void catch_exhausted_stack() {
#ifndef __SANITIZE_ADDRESS__  // which reports it itself
  alignas(16) static std::array<char, 64 * 1024> memory;
  const stack_t stack{memory.data(), 0, memory.size()};
  struct sigaction action = {};
  action.sa_sigaction = end_without_stack;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_RESETHAND;
  sigemptyset(&action.sa_mask);
  if (sigaltstack(&stack, nullptr) == 0) sigaction(SIGSEGV, &action, nullptr);
#endif
}
void catch_broken_pipe() { handle(SIGPIPE, leave_broken_pipe, SA_RESTART); }

PromptSignals::PromptSignals() {
  static_assert(prompt_signals.size() == count_);
  sigset_t blocked;
  sigemptyset(&blocked);
  for (int signal : prompt_signals) sigaddset(&blocked, signal);
  pthread_sigmask(SIG_BLOCK, &blocked, &before_);
  for (std::size_t i = 0; i < count_; ++i) {
    sigaction(prompt_signals[i], nullptr, &actions_[i]);
    // Who was started with a signal ignored (nohup) keeps ignoring it.
    if (actions_[i].sa_handler != SIG_IGN || prompt_signals[i] == SIGINT)
      handle(prompt_signals[i], note_signal);
  }
}

PromptSignals::~PromptSignals() {
  for (std::size_t i = 0; i < count_; ++i) sigaction(prompt_signals[i], &actions_[i], nullptr);
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

int PromptSignals::wait(int fd) const {
  arrived = 0;
  pollfd input{fd, POLLIN, 0};
  sigset_t open = before_;
  for (int signal : prompt_signals) sigdelset(&open, signal);
  // A signal goes before input: Ctrl-C has emptied the terminal's queue, so what stands there now was typed
  // after it. ppoll alone would report the input and leave the signal pending.
  const timespec at_once{0, 0};
  if (ppoll(nullptr, 0, &at_once, &open) < 0 && errno == EINTR) return arrived;
  const bool terminal = isatty(fd);
  if (ppoll(&input, 1, nullptr, &open) < 0 && errno == EINTR) return arrived;
  // A terminal that goes away ends the input a moment before SIGHUP: that is no Ctrl-D of the user.
  const timespec soon{0, 100'000'000};
  if (terminal && (input.revents & POLLHUP) && ppoll(nullptr, 0, &soon, &open) < 0 && errno == EINTR)
    return arrived;
  return 0;
}

void default_action(int signal) {
  struct sigaction before;
  sigaction(signal, nullptr, &before);
  handle(signal, SIG_DFL);
  sigset_t only, saved;
  sigemptyset(&only);
  sigaddset(&only, signal);
  raise(signal);
  pthread_sigmask(SIG_UNBLOCK, &only, &saved);  // here it takes effect
  pthread_sigmask(SIG_SETMASK, &saved, nullptr);
  sigaction(signal, &before, nullptr);
}

}  // namespace pendula::shell
