#include "shell/sandbox/sandbox.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <utility>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "shell/sandbox/confine.hpp"
#include "shell/sandbox/filter.hpp"

namespace pendula::shell::sandbox {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double clock_share = 4;    ///< limit on elapsed time over limit on processor time
constexpr double start_seconds = 2;  ///< elapsed time allowed for the start on a loaded machine
constexpr std::size_t longest_report = std::size_t{64} << 20;
constexpr int report_in_child = 3;

/// A connection that cannot be opened through a path. CAUTION: not a pipe: Landlock does not prevent a
/// script from opening /proc/self/fd/3 again, which would let it write its own report. Sockets cannot be
/// opened like this.
class Pipe {
 public:
  Pipe() {
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_.data()) != 0)
      throw Error(text("no connection to another process: ", std::strerror(errno)));
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    for (int end : ends_)
      if (end >= 0) close(end);
  }
  int reading() const { return ends_[0]; }
  int writing() const { return ends_[1]; }
  void close_writing() { close(std::exchange(ends_[1], -1)); }

 private:
  std::array<int, 2> ends_{-1, -1};
};

bool write_all(int descriptor, const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t n = write(descriptor, bytes, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

// ── the child ──

/// Never returns. Exit status: 0 finished, 1 failed, 2 the sandbox could not be set up.
[[noreturn]] void be_child(const Limits& limits, const Prepare& prepare, const Pipe& out, const Pipe& err,
                           int report) {
  int status = 1;
  Reporter reporter(report_in_child);
  try {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
    const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (nothing < 0 || dup2(nothing, 0) < 0 || dup2(out.writing(), 1) < 0 || dup2(err.writing(), 2) < 0)
      _exit(2);
    limit_process(limits, report);
    const Work work = prepare(reporter);
    std::fflush(nullptr);
    confine(limits, report_in_child);
    status = work() ? 0 : 1;
  } catch (const std::bad_alloc&) {
    reporter.message("not enough memory");
  } catch (const std::exception& e) {
    reporter.message(e.what());
  }
  std::fflush(nullptr);
  _exit(status);
}

// ── the parent ──

/// Processor time of a process that has not been reaped yet.
double processor_time(pid_t pid) {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(pid, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void append_once(std::vector<std::string>& list, const std::string& entry) {
  constexpr std::size_t enough = 20;
  if (list.size() < enough && std::find(list.begin(), list.end(), entry) == list.end()) list.push_back(entry);
}

class Watch {
 public:
  Watch(const Limits& limits, const Print& print, pid_t pid, Pipe& out, Pipe& err, Pipe& report)
      : limits_(limits), print_(print), pid_(pid), open_{out.reading(), err.reading(), report.reading()} {}

  /// Reads until the child has closed its ends, by itself or because it was killed.
  void follow() {
    while (open_[0] >= 0 || open_[1] >= 0 || open_[2] >= 0) {
      std::array<pollfd, 3> waiting{};
      for (std::size_t k = 0; k < 3; ++k) waiting[k] = {open_[k], POLLIN, 0};
      if (poll(waiting.data(), 3, 10) > 0)
        for (std::size_t k = 0; k < 3; ++k)
          if (waiting[k].revents != 0) take(k);
      look();
    }
  }

  Outcome finish() {
    outcome_.seconds = elapsed();
    int status = 0;
    rusage used{};
    while (wait4(pid_, &status, 0, &used) < 0 && errno == EINTR) continue;
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    outcome_.processor_seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
    outcome_.memory = static_cast<std::size_t>(used.ru_maxrss) * 1024;
    read_frames();
    judge(status);
    return std::move(outcome_);
  }

 private:
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  void end(Kind kind, const std::string& why) {
    if (ended_) return;
    ended_ = true;
    outcome_.kind = kind;
    outcome_.message = why;
    kill(pid_, SIGKILL);
  }

  void look() {
    if (interrupt_requested) end(Kind::interrupted, "interrupted");
    if (processor_time(pid_) > limits_.seconds || elapsed() > clock_share * limits_.seconds + start_seconds)
      end(Kind::time, text("the time limit of ", limits_.seconds, " s is exceeded"));
  }

  void take(std::size_t k) {
    char buffer[1 << 16];
    const ssize_t n = read(open_[k], buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) return;
    if (n <= 0) {
      open_[k] = -1;
      return;
    }
    const auto size = static_cast<std::size_t>(n);
    if (k == 2) {
      frames_.append(buffer, size);
      if (frames_.size() > longest_report) end(Kind::memory, "the result is too large");
      return;
    }
    const std::size_t room = limits_.output - std::min(limits_.output, printed_);
    if (room > 0) print_(static_cast<int>(k) + 1, buffer, std::min(room, size));
    printed_ += size;
    if (printed_ > limits_.output)
      end(Kind::output, text("more than ", limits_.output, " bytes were printed"));
  }

  void read_frames() {
    for (std::size_t at = 0; at + 5 <= frames_.size();) {
      const char kind = frames_[at];
      std::uint32_t size = 0;
      std::memcpy(&size, frames_.data() + at + 1, sizeof size);
      if (size > frames_.size() - at - 5) return;
      const std::string body = frames_.substr(at + 5, size);
      at += 5 + size;
      if (kind == 'M' && !ended_) outcome_.message = body;
      if (kind == 'F') append_once(outcome_.forbidden, body);
      if (kind == 'R') outcome_.results.push_back(body);
      if (kind != 'S' || size != 4) continue;
      int number = 0;
      std::memcpy(&number, body.data(), sizeof number);
      append_once(outcome_.forbidden, call_name(number));
    }
  }

  void judge(int status) {
    if (ended_) return;
    if (WIFSIGNALED(status)) {
      const int signal = WTERMSIG(status);
      outcome_.kind = signal == SIGXCPU ? Kind::time : Kind::crash;
      outcome_.message = signal == SIGXCPU ? text("the time limit of ", limits_.seconds, " s is exceeded")
                                           : text("ended by signal ", signal, " (", strsignal(signal), ")");
      return;
    }
    if (WEXITSTATUS(status) == 0) {
      outcome_.kind = outcome_.forbidden.empty() ? Kind::finished : Kind::forbidden;
      return;
    }
    const bool memory = outcome_.message.find("not enough memory") != std::string::npos;
    outcome_.kind = !outcome_.forbidden.empty() ? Kind::forbidden : memory ? Kind::memory : Kind::error;
    if (outcome_.kind == Kind::error && outcome_.message.empty())
      outcome_.message = text("the script ended itself by os.exit with status ", WEXITSTATUS(status));
  }

  const Limits& limits_;
  const Print& print_;
  pid_t pid_;
  std::array<int, 3> open_;
  Clock::time_point begin_ = Clock::now();
  std::size_t printed_ = 0;
  std::string frames_;
  bool ended_ = false;
  Outcome outcome_;
};

/// The number at the beginning of `words` and the unit after it.
std::pair<double, std::string> quantity(const std::string& words, const char* example) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(words, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || !(value > 0) || value > 1e15)
    throw std::invalid_argument("'" + words + "' is not understood; write it as in " + example);
  return {value, words.substr(used)};
}

}  // namespace

double seconds_of(const std::string& words) {
  const auto [value, unit] = quantity(words, "--time 10s");
  if (unit.empty() || unit == "s") return value;
  if (unit == "ms") return value / 1000;
  if (unit == "min") return value * 60;
  throw std::invalid_argument("'" + words +
                              "' has an unknown unit; ms, s and min are known, as in --time 10s");
}

std::size_t bytes_of(const std::string& words) {
  const auto [value, unit] = quantity(words, "--memory 1G");
  const std::string letters = "KMG";
  double factor = 1;
  if (!unit.empty()) {
    const auto at = letters.find(unit[0]);
    const std::string rest = unit.substr(1);
    if (at == std::string::npos || !(rest.empty() || rest == "B" || rest == "iB"))
      throw std::invalid_argument("'" + words +
                                  "' has an unknown unit; K, M and G are known, as in --memory 1G");
    factor = static_cast<double>(std::size_t{1} << (10 * (at + 1)));
  }
  return static_cast<std::size_t>(value * factor);
}

const char* name_of(Kind kind) {
  constexpr const char* names[] = {"finished", "error",  "forbidden", "time",
                                   "memory",   "output", "crash",     "interrupted"};
  return names[static_cast<int>(kind)];
}

int status_of(Kind kind) {
  constexpr int status[] = {0, 1, 3, 4, 5, 6, 7, 130};
  return status[static_cast<int>(kind)];
}

void Reporter::send(char kind, const std::string& text) {
  const auto size = static_cast<std::uint32_t>(text.size());
  std::string frame(5, kind);
  std::memcpy(frame.data() + 1, &size, sizeof size);
  frame += text;
  write_all(descriptor_, frame.data(), frame.size());
}

void require_confinement() {
  if (landlock_version() == 0)
    throw Error(
        "safe mode needs Landlock (Linux 5.13 or later, with landlock among the kernel's security modules), "
        "which this system lacks; run the script in a container or a virtual machine instead");
}

Outcome run(const Limits& limits, const Prepare& prepare, const Print& print) {
  require_confinement();
  Pipe out, err, report;
  const pid_t pid = fork();
  if (pid < 0) throw Error(text("no process can be started: ", std::strerror(errno)));
  if (pid == 0) be_child(limits, prepare, out, err, report.writing());
  for (Pipe* pipe : {&out, &err, &report}) pipe->close_writing();
  Watch watch(limits, print, pid, out, err, report);
  try {
    watch.follow();
  } catch (...) {
    kill(pid, SIGKILL);
    watch.finish();
    throw;
  }
  return watch.finish();
}

}  // namespace pendula::shell::sandbox
