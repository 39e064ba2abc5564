#include "base/stoppable.hpp"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula {
namespace {

using Matrices = std::vector<Eigen::MatrixXd>;
using Work = std::function<Matrices()>;

constexpr double long_work = 1e9;  // operations; 0.2 s at 5 GFlop/s, typical of portable x86-64 code

enum class Answer : char { matrices, error, failure, no_memory };

// ── the child ──

bool send(int out, const void* bytes, std::size_t size) {
  const char* at = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t n = write(out, at, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    at += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

bool send_text(int out, Answer kind, const char* words) {
  return send(out, &kind, 1) && send(out, words, std::strlen(words));
}

bool send_matrices(int out, const Matrices& matrices) {
  const Answer kind = Answer::matrices;
  if (!send(out, &kind, 1)) return false;
  for (const Eigen::MatrixXd& m : matrices) {
    const Eigen::Index shape[] = {m.rows(), m.cols()};
    if (!send(out, shape, sizeof shape) ||
        !send(out, m.data(), static_cast<std::size_t>(m.size()) * sizeof(double)))
      return false;
  }
  return true;
}

[[noreturn]] void be_child(int out, pid_t parent, const Work& work) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // the parent may have ended before the call above
  for (int signal : {SIGTERM, SIGHUP, SIGPIPE}) std::signal(signal, SIG_DFL);
  std::signal(SIGINT, SIG_IGN);  // the terminal signals both processes; the parent ends this one
  bool sent = false;
  try {
    sent = send_matrices(out, work());
  } catch (const std::bad_alloc&) {
    sent = send_text(out, Answer::no_memory, "");
  } catch (const Failure& e) {
    sent = send_text(out, Answer::failure, e.what());
  } catch (const std::exception& e) {
    sent = send_text(out, Answer::error, e.what());
  }
  _exit(sent ? 0 : 1);
}

// ── the parent ──

class Child {
 public:
  Child(pid_t pid, int in) : pid_(pid), in_(in) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    close(in_);
    kill(pid_, SIGKILL);  // after an error or Ctrl-C; otherwise it is ending anyway
    while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) continue;
  }

  Matrices answer() {
    Answer kind{};
    if (!receive(&kind, 1))
      throw ChildEnded("the process that computed it ended unexpectedly; there may be too little memory");
    if (kind == Answer::no_memory) throw std::bad_alloc();
    if (kind == Answer::failure) throw Failure(rest());
    if (kind == Answer::error) throw Error(rest());
    Matrices matrices;
    Eigen::Index shape[2];
    while (receive(shape, sizeof shape)) {
      Eigen::MatrixXd& m = matrices.emplace_back(shape[0], shape[1]);
      if (!receive(m.data(), static_cast<std::size_t>(m.size()) * sizeof(double)) && m.size() > 0)
        throw ChildEnded("the process that computed it ended before its result was complete");
    }
    return matrices;
  }

 private:
  /// Reads up to `size` bytes; 0 at the end.
  std::size_t some(void* bytes, std::size_t size) {
    while (true) {
      poll_interrupt();
      pollfd waiting{in_, POLLIN, 0};
      if (poll(&waiting, 1, 50) <= 0) continue;  // a signal between the check and the wait delays by 50 ms
      const ssize_t n = read(in_, bytes, size);
      if (n >= 0) return static_cast<std::size_t>(n);
      if (errno != EINTR) return 0;
    }
  }

  bool receive(void* bytes, std::size_t size) {
    char* at = static_cast<char*>(bytes);
    while (size > 0) {
      const std::size_t n = some(at, size);
      if (n == 0) return false;
      at += n;
      size -= n;
    }
    return true;
  }

  std::string rest() {
    std::string words;
    char buffer[4096];
    for (std::size_t n = some(buffer, sizeof buffer); n > 0; n = some(buffer, sizeof buffer))
      words.append(buffer, n);
    return words;
  }

  pid_t pid_;
  int in_;
};

}  // namespace

Matrices stoppable(double operations, const Work& work) {
  int ends[2];
  if (operations < long_work || pipe2(ends, O_CLOEXEC) != 0) return work();
  const pid_t parent = getpid(), child = fork();
  if (child == 0) {
    close(ends[0]);
    be_child(ends[1], parent, work);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    return work();
  }
  return Child(child, ends[0]).answer();
}

}  // namespace pendula
