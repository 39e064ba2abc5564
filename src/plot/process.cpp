// Runs gnuplot without a shell: the script on its standard input, the picture from its standard output into a
// file that appears complete or not at all.
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/error.hpp"
#include "base/files/draft.hpp"
#include "base/interrupt.hpp"
#include "plot/script.hpp"

extern char** environ;

namespace pendula::plot {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  int get() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

std::string reason() { return std::strerror(errno); }

/// A descriptor of a file in memory with the script, positioned at its beginning.
int script_descriptor(const std::string& script) {
  const int fd = memfd_create("pendula-script", MFD_CLOEXEC);
  if (fd < 0) throw Failure("no memory for the gnuplot script: " + reason());
  for (size_t written = 0; written < script.size();) {
    const ssize_t n = write(fd, script.data() + written, script.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const std::string why = reason();
      ::close(fd);
      throw Failure("no memory for the gnuplot script: " + why);
    }
    written += static_cast<size_t>(n);
  }
  lseek(fd, 0, SEEK_SET);
  return fd;
}

/// A child process that the destructor kills and reaps if the scope is left early.
class Child {
 public:
  Child(int in, int out, int err) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in, 0);
    posix_spawn_file_actions_adddup2(&actions, out, 1);
    posix_spawn_file_actions_adddup2(&actions, err, 2);
    // gnuplot must not inherit the signal mask of the session, which blocks SIGINT outside its prompt
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    char name[] = "gnuplot", defaults[] = "-d";  // -d: the user's ~/.gnuplot does not change our figures
    char* arguments[] = {name, defaults, nullptr};
    const int error = posix_spawnp(&pid_, name, &actions, &attributes, arguments, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (error == 0) return;
    pid_ = -1;
    if (error == ENOENT)
      throw Error(
          "saving a figure needs gnuplot, which is not installed: apt-get install gnuplot-nox "
          "(the drawing in the terminal, :show(), needs nothing)");
    throw Failure(std::string("gnuplot could not be started: ") + std::strerror(error));
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (pid_ < 0) return;
    kill(pid_, SIGKILL);
    wait();
  }
  /// The exit status in the encoding of waitpid.
  int wait() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) continue;
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_ = -1;
};

/// All output of the child until it closes the pipe; Ctrl-C is noticed within 20 ms.
std::string listen(int fd) {
  std::string said;
  for (;;) {
    poll_interrupt();
    pollfd waiting{fd, POLLIN, 0};
    if (poll(&waiting, 1, 20) <= 0) continue;
    char buffer[4096];
    const ssize_t n = read(fd, buffer, sizeof buffer);
    if (n == 0) return said;
    constexpr std::size_t most = 100'000;  // characters of an error message; the rest is read and dropped
    if (n > 0 && said.size() < most) said.append(buffer, static_cast<size_t>(n));
    if (n < 0 && errno != EINTR && errno != EAGAIN) return said;
  }
}

/// The line with the reason: gnuplot marks the place with a caret and gives the reason on the next line.
std::string last_line(std::string said) {
  while (!said.empty() && (said.back() == '\n' || said.back() == ' ')) said.pop_back();
  const size_t start = said.rfind('\n');
  return start == std::string::npos ? said : said.substr(start + 1);
}

}  // namespace

void run_gnuplot(const std::string& script, const std::string& path) {
  Draft draft(path, "save");
  const Descriptor in(script_descriptor(script));
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Failure("gnuplot could not be started: " + reason());
  const Descriptor hear(ends[0]);
  Descriptor speak(ends[1]);
  Child gnuplot(in.get(), draft.descriptor(), speak.get());
  speak.close();
  const std::string said = listen(hear.get());
  const int status = gnuplot.wait();
  poll_interrupt();  // Ctrl-C ends gnuplot as well, which is not a failure of gnuplot
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || draft.is_empty())
    throw Failure("gnuplot could not write '" + path +
                  "': " + (said.empty() ? "it ended without a message" : last_line(said)));
  draft.publish();
}

}  // namespace pendula::plot
