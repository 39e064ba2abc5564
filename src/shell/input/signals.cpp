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

// Only calls that are async-signal-safe: time, write.
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

/// Is the reading end of the pipe closed?
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
  // Raised again with the default action, the signal ends the process when this handler returns.
  if (broken(STDOUT_FILENO) || broken(STDERR_FILENO)) {
    remove_unfinished_files();
    std::signal(signal, SIG_DFL);
    raise(signal);
  }
  errno = saved;
}

extern "C" void end_without_drafts(int signal) {
  remove_unfinished_files();
  raise(signal);  // SA_RESETHAND has restored the default action
}

/// For a recursion that does not check the stack left: when it exceeds the stack, the
/// process cannot continue.
extern "C" void end_without_stack(int signal, siginfo_t* info, void*) {
  if (is_beyond_stack(info->si_addr)) {
    constexpr char text[] =
        "pendula: the stack is used up, something is nested too deeply for it; a larger one is given by "
        "'ulimit -s unlimited' before the program starts\n";
    (void)!write(STDERR_FILENO, text, sizeof text - 1);
    remove_unfinished_files();
    _exit(1);
  }
  raise(signal);  // SA_RESETHAND has restored the default action
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

/// SIGTERM and SIGHUP still end the process, but first remove incomplete files.
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
#ifndef __SANITIZE_ADDRESS__  // AddressSanitizer reports the overflow itself
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
    // A signal ignored at the start of the program (nohup) stays ignored.
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
  // Signals first: Ctrl-C flushes the input queue of the terminal, so input that is available now was typed
  // after it. ppoll alone would report the input and leave the signal pending.
  const timespec at_once{0, 0};
  if (ppoll(nullptr, 0, &at_once, &open) < 0 && errno == EINTR) return arrived;
  const bool terminal = isatty(fd);
  if (ppoll(&input, 1, nullptr, &open) < 0 && errno == EINTR) return arrived;
  // A terminal that is closed reports the end of input shortly before SIGHUP; without the wait that would be
  // taken for Ctrl-D.
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
  pthread_sigmask(SIG_UNBLOCK, &only, &saved);  // the signal is delivered here
  pthread_sigmask(SIG_SETMASK, &saved, nullptr);
  sigaction(signal, &before, nullptr);
}

}  // namespace pendula::shell
